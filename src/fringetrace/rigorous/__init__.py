"""Exact wave solutions of cylinders, gratings of cylinders and spheres, and the validity of rays."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
