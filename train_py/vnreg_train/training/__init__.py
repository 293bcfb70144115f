"""Two-stage training (paper, section IV-B): encoder and coarse register first, then the fine one."""
