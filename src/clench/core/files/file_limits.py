"""The largest files that are read, and limits on their content; docs/security.md lists them.

They are far above the needs of hands, objects and grasps. A larger file is refused with one sentence.
"""

from __future__ import annotations

from typing import Final

_MB: Final = 1 << 20

#: The text of a hand model, all its includes together [bytes].
MODEL_BYTES: Final = 8 * _MB
#: A mesh, a texture, or another file that a model names [bytes].
MESH_BYTES: Final = 256 * _MB
#: All meshes and textures of a hand model together [bytes].
ASSET_BYTES: Final = 512 * _MB
#: A JSON file, the document of a recorded solve, or the scene of a glTF file [bytes].
JSON_BYTES: Final = 16 * _MB
#: A TOML file: hand file, calibration file, joint map [bytes].
TOML_BYTES: Final = 1 * _MB
#: A YAML file of grasps [bytes].
YAML_BYTES: Final = 8 * _MB
#: An npy file of poses, or the arrays of an npz file, unpacked [bytes].
ARRAY_BYTES: Final = 1024 * _MB
#: The list of names at the end of an npz file [bytes].
ARCHIVE_LIST_BYTES: Final = 1 * _MB
#: An npy file with a pickled dictionary of grasps [bytes].
PICKLE_BYTES: Final = 8 * _MB

#: Levels of lists and objects in JSON, TOML, YAML and pickles.
DOCUMENT_DEPTH: Final = 64
#: Values in a YAML file or a pickle, where a value may stand for many others.
DOCUMENT_VALUES: Final = 1_000_000
#: Levels of elements in URDF and MJCF.
XML_DEPTH: Final = 256
#: Elements in URDF and MJCF.
XML_ELEMENTS: Final = 100_000
#: Bodies, geoms, joints and sites of a model, with the copies that MJCF's `replicate` and `flexcomp` make.
MODEL_PARTS: Final = 20_000
#: Links of a URDF, bodies of a compiled MJCF.
MODEL_BODIES: Final = 1_000
#: The largest number in a model but for limits of effort and velocity; lengths and angles have closer limits [-].
MODEL_NUMBER: Final = 1e15
#: Pixels of a texture, or points of a height field.
PICTURE_PIXELS: Final = 8192 * 8192
#: Length of a line of an OBJ file, or of one value of YAML [bytes].
LINE_BYTES: Final = 65_536
#: Nodes, and primitives of meshes, in a glTF scene.
SCENE_PARTS: Final = 2_000
#: Triangles of a mesh file, with the copies that a scene makes.
MESH_TRIANGLES: Final = 10_000_000

#: Planes and rounds of a command, and items of each of its lists.
COMMAND_ITEMS: Final = 1_000
#: Sets that the grids of a command make together.
COMMAND_CANDIDATES: Final = 10_000

#: Rows of one group of a Parquet file of grasps.
DATASET_GROUP_ROWS: Final = 65_536
