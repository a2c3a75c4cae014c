"""Ray-triangle intersection: Embree finds the facet, float64 measures it."""
