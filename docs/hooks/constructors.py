"""Signatures of classes that write no `__init__`: `eqx.Module`s, named tuples, data classes.

griffe knows the constructors of data classes; this extension adds those of the other two, and gives
all of them the source of their class.
"""

import griffe

_MADE_OF_FIELDS = {"equinox.Module", "typing.NamedTuple"}


class Constructors(griffe.Extension):
    """Stands behind griffe's own extension for data classes."""

    def on_package(self, *, pkg, **_):
        _walk(pkg)


def _walk(module):
    for member in list(module.members.values()):
        if member.is_alias:
            continue
        if member.is_module:
            _walk(member)
        elif member.is_class:
            if "__init__" not in member.members and _made_of_fields(member):
                member.set_member("__init__", _constructor(member))
            init = member.members.get("__init__")
            if init is not None and not init.lineno:
                init.lineno, init.endlineno = member.lineno, member.endlineno


def _made_of_fields(cls) -> bool:
    bases = {getattr(base, "canonical_path", str(base)) for base in cls.bases}
    return bool(bases & _MADE_OF_FIELDS) or any(map(_made_of_fields, cls.resolved_bases))


def _constructor(cls) -> griffe.Function:
    """Its arguments are the annotated fields of the class and of those it is derived from."""
    fields = {}
    for owner in [*reversed(cls.mro()), cls]:
        for name, member in owner.members.items():
            given = member.is_attribute and "property" not in member.labels
            if given and member.annotation is not None and not name.startswith("_"):
                fields[name] = member
    kind = griffe.ParameterKind.positional_or_keyword
    arguments = [
        griffe.Parameter(name, annotation=m.annotation, kind=kind, default=_default(m.value))
        for name, m in fields.items()
    ]
    parameters = griffe.Parameters(griffe.Parameter("self", kind=kind), *arguments)
    return griffe.Function("__init__", parameters=parameters, parent=cls)


def _default(value):
    """The default of a field; none for an `eqx.field(...)` that has none."""
    if isinstance(value, griffe.ExprCall) and value.canonical_path == "equinox.field":
        given = {getattr(a, "name", None): a.value for a in value.arguments if hasattr(a, "value")}
        return given.get("default", given.get("default_factory"))
    return value
