"""Intensity: reference curve, Oren–Nayar reflectance, roughness, correction (Xu et al., 2018)."""
