"""Settings of all tests."""

from hypothesis import settings

# kernels are compiled at first use: a first example may take seconds
settings.register_profile("fringetrace", deadline=None, print_blob=True)
settings.load_profile("fringetrace")
