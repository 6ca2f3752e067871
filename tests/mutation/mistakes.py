"""The mistakes that are put into a module, one at a time."""

import ast
import copy
from collections.abc import Iterator

_COMPARED = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
_ORDERED = ast.Lt | ast.LtE | ast.Gt | ast.GtE
_COMPUTED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
_CHOSEN = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum"}
_ENDS = ast.Return | ast.Raise | ast.Continue | ast.Break


def mutants(tree: ast.Module) -> Iterator[tuple[int, str, ast.Module]]:
    """Yield every mutant of a module: its line, what was changed, and the whole tree."""
    for number, node in enumerate(_nodes(tree)):
        for kind in _kinds(node):
            changed = copy.deepcopy(tree)
            again = _nodes(changed)[number]
            before = _text(again)
            _change(again, kind)
            yield again.lineno, f"{before}  ->  {_text(again)}", changed


def _nodes(tree: ast.Module) -> list[ast.AST]:
    """Return all nodes in the bodies of functions and methods."""
    classes = [body for body in tree.body if isinstance(body, ast.ClassDef)]
    functions = [body for owner in (tree, *classes) for body in owner.body if isinstance(body, ast.FunctionDef)]
    return [node for function in functions for statement in function.body for node in ast.walk(statement)]


def _text(node: ast.AST) -> str:
    """Return the first line of a node: of a condition, without what follows from it."""
    return ast.unparse(node).split("\n", 1)[0]


def _kinds(node: ast.AST) -> list[str]:
    match node:
        case ast.Compare(ops=[op, *_]) if type(op) in _COMPARED:
            return ["bound", "reverse"] if isinstance(op, _ORDERED) else ["bound"]
        case ast.BinOp(op=op) if type(op) in _COMPUTED:
            return ["operator"]
        case ast.BoolOp():
            return ["and or"]
        case ast.UnaryOp(op=ast.USub()):
            return ["sign"]
        case ast.Constant(value=float()):
            return ["constant"]
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(value=ast.Name(id="np"), attr=name)) if name in _CHOSEN:
            return ["choice"]
        case ast.If(body=[*_, last], orelse=[]) if isinstance(last, _ENDS):
            return ["check"]
        case ast.Expr(value=ast.Call()) | ast.Assign(targets=[ast.Subscript()]):
            return ["statement"]
    return []


def _change(node: ast.AST, kind: str) -> None:
    match node:
        case ast.Compare() if kind == "bound":
            node.ops[0] = _COMPARED[type(node.ops[0])]()
        case ast.Compare():
            node.left, node.comparators[0] = node.comparators[0], node.left
        case ast.BinOp():
            node.op = _COMPUTED[type(node.op)]()
        case ast.BoolOp():
            node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        case ast.UnaryOp():
            node.op = ast.UAdd()
        case ast.Constant(value=float()):
            node.value = 2.0 * float(node.value) if node.value else 1.0
        case ast.Call(func=ast.Name()):
            node.func.id = _CHOSEN[node.func.id]
        case ast.Call(func=ast.Attribute()):
            node.func.attr = _CHOSEN[node.func.attr]
        case ast.If():
            node.test = ast.Constant(False)
        case ast.Expr():
            node.value = ast.Constant(None)
        case ast.Assign():
            node.targets = [ast.Name("_", ast.Store())]
