"""What matter and surfaces do to a plane wave: materials, films, interfaces and thin elements."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
