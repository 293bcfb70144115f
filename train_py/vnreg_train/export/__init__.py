"""From torch to the engine: model files, golden files, and the reference the engine is held to."""
