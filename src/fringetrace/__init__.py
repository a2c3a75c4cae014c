"""Triangle meshes to full-field interferograms, with a phase you can trust.

>>> import fringetrace as ft
>>> from fringetrace import mm, nm
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
