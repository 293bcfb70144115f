"""The paper's own tables: ablation, recall beside its figures, speed; docs/paper.md."""
