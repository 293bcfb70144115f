"""Recall and confidence of a model, measured through the engine: the shipped product's figures."""
