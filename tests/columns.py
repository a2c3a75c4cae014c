"""The columns of paths that tests compare."""

# All that is known of paths without a record.
BARE = (
    "ray", "fate", "bounces", "reflections", "length", "origin", "direction", "amplitude", "lost", "key",
)  # fmt: skip
