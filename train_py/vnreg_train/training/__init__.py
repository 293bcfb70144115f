"""Two-stage training (paper, section IV-B): encoder and coarse register, then the fine one."""
