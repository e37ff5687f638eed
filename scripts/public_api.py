"""Turns rustdoc's JSON of a crate into a sorted list of its public items, one a line. See public_api.sh."""
import json
import sys

# What the derives of other traits bring along; it says nothing that those do not.
IMPLIED = {
    "StructuralPartialEq", "FromReflect", "GetTypeRegistration", "PartialReflect", "Typed", "TypePath", "Struct", "TupleStruct", "Enum",
    "SyncComponent", "VisitAssetDependencies",
}


def args_text(args):
    if not args:
        return ""
    if "parenthesized" in args:
        inner = args["parenthesized"]
        output = f" -> {type_text(inner['output'])}" if inner["output"] else ""
        return f"({', '.join(map(type_text, inner['inputs']))}){output}"
    inner = args["angle_bracketed"]
    texts = [arg_text(arg) for arg in inner["args"]]
    for constraint in inner["constraints"]:
        binding = constraint["binding"]
        if "equality" in binding:
            texts.append(f"{constraint['name']} = {term_text(binding['equality'])}")
        else:
            texts.append(f"{constraint['name']}: {bounds_text(binding['constraint'])}")
    return f"<{', '.join(texts)}>" if texts else ""


def arg_text(arg):
    if arg == "infer":
        return "_"
    kind, value = next(iter(arg.items()))
    return {"type": lambda: type_text(value), "lifetime": lambda: value, "const": lambda: value["expr"]}[kind]()


def term_text(term):
    return type_text(term["type"]) if "type" in term else term["constant"]["expr"]


def path_text(path):
    return path["path"].split("::")[-1] + args_text(path["args"])


def bounds_text(bounds):
    texts = []
    for bound in bounds:
        if "trait_bound" in bound:
            prefix = "?" if bound["trait_bound"]["modifier"] == "maybe" else ""
            texts.append(prefix + path_text(bound["trait_bound"]["trait"]))
        elif "outlives" in bound:
            texts.append(bound["outlives"])
    return " + ".join(texts)


def type_text(type_):
    if type_ == "infer":
        return "_"
    kind, value = next(iter(type_.items()))
    if kind == "resolved_path":
        return path_text(value)
    if kind in ("generic", "primitive"):
        return value
    if kind == "tuple":
        return f"({', '.join(map(type_text, value))})"
    if kind == "slice":
        return f"[{type_text(value)}]"
    if kind == "array":
        return f"[{type_text(value['type'])}; {value['len']}]"
    if kind == "borrowed_ref":
        lifetime = f"{value['lifetime']} " if value["lifetime"] else ""
        return f"&{lifetime}{'mut ' if value['is_mutable'] else ''}{type_text(value['type'])}"
    if kind == "raw_pointer":
        return f"*{'mut' if value['is_mutable'] else 'const'} {type_text(value['type'])}"
    if kind == "impl_trait":
        return f"impl {bounds_text(value)}"
    if kind == "dyn_trait":
        texts = [path_text(trait["trait"]) for trait in value["traits"]]
        return f"dyn {' + '.join(texts + [value['lifetime']] if value['lifetime'] else texts)}"
    if kind == "qualified_path":
        owner = type_text(value["self_type"])
        if value["trait"] and value["trait"]["path"]:
            owner = f"<{owner} as {path_text(value['trait'])}>"
        return f"{owner}::{value['name']}"
    if kind == "function_pointer":
        return "fn" + signature_text(value["sig"], names=False)
    raise ValueError(f"a kind of type that this script does not know: {kind}")


def signature_text(signature, names=True):
    inputs = []
    for name, type_ in signature["inputs"]:
        text = type_text(type_)
        if name == "self":
            text = {"Self": "self", "&Self": "&self", "&mut Self": "&mut self"}.get(text, f"self: {text}")
        elif names:
            text = f"{name}: {text}"
        inputs.append(text)
    output = f" -> {type_text(signature['output'])}" if signature["output"] else ""
    return f"({', '.join(inputs)}){output}"


def generics_text(generics):
    texts = []
    for parameter in generics["params"]:
        kind, value = next(iter(parameter["kind"].items()))
        if kind == "type" and not value["is_synthetic"]:
            texts.append(parameter["name"] + (f": {bounds_text(value['bounds'])}" if value["bounds"] else ""))
        elif kind == "lifetime":
            texts.append(parameter["name"])
        elif kind == "const":
            texts.append(f"const {parameter['name']}: {type_text(value['type'])}")
    where = []
    for predicate in generics["where_predicates"]:
        if "bound_predicate" in predicate:
            bound = predicate["bound_predicate"]
            where.append(f"{type_text(bound['type'])}: {bounds_text(bound['bounds'])}")
    return (f"<{', '.join(texts)}>" if texts else "", f" where {', '.join(where)}" if where else "")


def function_text(item):
    function = item["inner"]["function"]
    generics, where = generics_text(function["generics"])
    header = function["header"]
    words = [word for word, key in (("const", "is_const"), ("async", "is_async"), ("unsafe", "is_unsafe")) if header[key]]
    return " ".join(words + ["fn"]), f"{generics}{signature_text(function['sig'])}{where}"


class Api:
    def __init__(self, crate):
        self.index = crate["index"]
        self.paths = crate["paths"]
        self.lines = set()
        # items by id, and where they were first listed
        self.places = {}

    def add(self, item, text):
        self.lines.add(text + (" #[deprecated]" if item["deprecation"] else ""))

    def is_hidden(self, item):
        return any("doc(hidden)" in str(attribute) or "hidden" == attribute for attribute in item["attrs"])

    def children(self, ids):
        return [self.index[str(id_)] for id_ in ids if str(id_) in self.index]

    def visit(self, item, path, name=None):
        """Adds an item that stands in the module or type `path`."""
        kind = next(iter(item["inner"]))
        inner = item["inner"][kind]
        name = name or item["name"]
        here = f"{path}::{name}" if path else name
        if self.is_hidden(item):
            return
        if kind != "use" and self.places.setdefault(item["id"], here) != here:
            # such as in the prelude
            self.add(item, f"{here} use {self.places[item['id']]}")
        elif kind == "module":
            self.add(item, f"{here} mod")
            for child in sorted(self.children(inner["items"]), key=lambda child: child["name"] == "prelude"):
                self.visit(child, here)
        elif kind == "use":
            target = self.index.get(str(inner["id"]))
            if inner["is_glob"]:
                for child in self.children(target["inner"]["module"]["items"] if target else []):
                    self.visit(child, path)
            elif target:
                self.visit(target, path, inner["name"])
            else:
                self.add(item, f"{path}::{inner['name']} use {inner['source']}")
        elif kind == "struct":
            self.struct(item, inner, here)
        elif kind == "enum":
            self.add(item, f"{here} enum{generics_text(inner['generics'])[0]}{self.openness(item)}")
            for variant in self.children(inner["variants"]):
                self.variant(variant, here)
            self.impls(inner["impls"], here)
        elif kind == "trait":
            generics, where = generics_text(inner["generics"])
            bounds = f": {bounds_text(inner['bounds'])}" if inner["bounds"] else ""
            self.add(item, f"{here} trait{generics}{bounds}{where}")
            for child in self.children(inner["items"]):
                self.member(child, here)
        elif kind == "type_alias":
            self.add(item, f"{here} type{generics_text(inner['generics'])[0]} = {type_text(inner['type'])}")
        else:
            self.member(item, path, name)

    def openness(self, item):
        return " #[non_exhaustive]" if any("non_exhaustive" in str(attribute) for attribute in item["attrs"]) else ""

    def struct(self, item, inner, here):
        kind = inner["kind"]
        fields, more = "", ""
        if isinstance(kind, dict) and "tuple" in kind:
            known = [self.index.get(str(id_)) if id_ is not None else None for id_ in kind["tuple"]]
            texts = [type_text(field["inner"]["struct_field"]) if field else "_" for field in known]
            fields = f"({', '.join(texts)})"
        elif isinstance(kind, dict):
            more = " with private fields" if kind["plain"]["has_stripped_fields"] else ""
        generics, where = generics_text(inner["generics"])
        self.add(item, f"{here} struct{generics}{fields}{where}{more}{self.openness(item)}")
        if isinstance(kind, dict) and "plain" in kind:
            for field in self.children(kind["plain"]["fields"]):
                self.add(field, f"{here}.{field['name']}: {type_text(field['inner']['struct_field'])}")
        self.impls(inner["impls"], here)

    def variant(self, variant, here):
        kind = variant["inner"]["variant"]["kind"]
        text = ""
        if isinstance(kind, dict) and "tuple" in kind:
            known = [self.index.get(str(id_)) for id_ in kind["tuple"] if id_ is not None]
            text = f"({', '.join(type_text(field['inner']['struct_field']) for field in known if field)})"
        elif isinstance(kind, dict):
            fields = self.children(kind["struct"]["fields"])
            texts = [f"{field['name']}: {type_text(field['inner']['struct_field'])}" for field in fields]
            text = f" {{ {', '.join(texts)} }}"
        if not self.is_hidden(variant):
            self.add(variant, f"{here}::{variant['name']} variant{text}")

    def member(self, item, here, name=None):
        if self.is_hidden(item):
            return
        kind = next(iter(item["inner"]))
        inner = item["inner"][kind]
        place = f"{here}::{name or item['name']}"
        if kind == "function":
            word, text = function_text(item)
            self.add(item, f"{place} {word}{text}")
        elif kind in ("constant", "assoc_const"):
            self.add(item, f"{place} const: {type_text(inner['type'])}")
        elif kind == "static":
            self.add(item, f"{place} static: {type_text(inner['type'])}")
        elif kind == "assoc_type":
            self.add(item, f"{place} type{' = ' + type_text(inner['type']) if inner['type'] else ''}")
        elif kind == "macro":
            self.add(item, f"{place} macro")

    def impls(self, ids, here):
        traits = set()
        for item in self.children(ids):
            inner = item["inner"]["impl"]
            if inner["is_synthetic"] or inner["blanket_impl"]:
                continue
            if not inner["trait"]:
                for child in self.children(inner["items"]):
                    self.member(child, here)
            elif inner["trait"]["path"].split("::")[-1] not in IMPLIED and not self.is_hidden(item):
                traits.add(path_text(inner["trait"]))
        if traits:
            self.lines.add(f"{here} impl {', '.join(sorted(traits))}")


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        crate = json.load(file)
    api = Api(crate)
    api.visit(crate["index"][str(crate["root"])], "")
    print("\n".join(sorted(api.lines)))


if __name__ == "__main__":
    main()
