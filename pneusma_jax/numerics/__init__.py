"""Functions finite at singular points, solves of one to three unknowns, plane lines."""
