"""Exact wave solutions of cylinders, gratings of them and spheres, and how far rays hold beside them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
