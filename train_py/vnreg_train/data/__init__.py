"""Shapes to train on and pairs to evaluate with: the furniture set and ModelNet40."""
