"""The paper's network: SE(3)-equivariant encoder, coarse register, fine register, decoder."""
