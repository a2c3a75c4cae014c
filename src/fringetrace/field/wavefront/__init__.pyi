from . import assemble as assemble
