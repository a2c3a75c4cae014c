"""Surfaces, light sources, the pixel sensor, the scene that they make, and the spectrum of its light."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
