from . import viewer as viewer
