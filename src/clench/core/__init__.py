"""The core: errors, poses, tolerances and files, which every layer may use."""
