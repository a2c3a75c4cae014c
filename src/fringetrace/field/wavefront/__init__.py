"""Wavefronts reconstructed from neighbouring rays, cut at edges, uniform across folds."""
