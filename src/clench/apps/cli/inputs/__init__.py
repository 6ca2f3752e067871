"""Turn options and files into hands, scenes, commands and controllers."""
