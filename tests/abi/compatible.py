"""compatible.py OLD NEW: do programs built against one interface run with another? Both as abidw
writes them, ids of types made from their names. What programs survive: further functions, and
members at the end of structs that begin with struct_size, behind all that there was."""
import sys
import xml.etree.ElementTree as xml


class Interface:
    def __init__(self, path):
        root = xml.parse(path).getroot()
        self.soname = root.get("soname")
        self.symbols = {(s.get("name"), s.get("version")) for s in root.iter("elf-symbol")}
        self.functions, self.structs, self.others = {}, {}, {}
        for f in root.iter("function-decl"):
            types = [e.get("type-id") for e in f if e.tag in ("parameter", "return")]
            self.functions[f.get("name")] = types
        for c in root.iter("class-decl"):
            members = [(m.find("var-decl").get("name"), m.find("var-decl").get("type-id"),
                        int(m.get("layout-offset-in-bits"))) for m in c.iter("data-member")]
            self.structs[c.get("name")] = (int(c.get("size-in-bits") or 0), members)
        for tag in ("type-decl", "typedef-decl", "pointer-type-def", "qualified-type-def",
                    "array-type-def", "function-type"):
            for t in root.iter(tag):
                children = [(e.tag, e.get("type-id"), e.get("length")) for e in t]
                self.others[t.get("id")] = (tag, t.get("name"), t.get("type-id"),
                                            t.get("size-in-bits"), t.get("const"), children)


def wrong_struct(name, old, new):
    (size, members), (new_size, new_members) = old, new
    if new_members[:len(members)] != members:
        return "struct %s: a member moved, changed or went" % name
    added = new_members[len(members):]
    if not added and new_size == size:
        return None
    if not members or members[0][0] != "struct_size":
        return "struct %s changed, and has no struct_size to tell by" % name
    for member, _, offset in added:
        if offset < size:
            return "struct %s: %s lies in padding, which old programs never set" % (name, member)
    return None


def problems(old, new):
    if old.soname != new.soname:
        yield "the SONAME is %s, it was %s" % (new.soname, old.soname)
    for name, version in sorted(old.symbols - new.symbols):
        yield "the symbol %s@%s is gone" % (name, version)
    for name, types in old.functions.items():
        if new.functions.get(name) != types:
            yield "the function %s is gone, or takes or gives another type" % name
    for name, struct in old.structs.items():
        wrong = wrong_struct(name, struct, new.structs.get(name, (0, [])))
        if wrong:
            yield wrong
    for key, what in old.others.items():
        if new.others.get(key, what) != what:
            yield "the type %s means something else" % what[1]


found = list(problems(Interface(sys.argv[1]), Interface(sys.argv[2])))
print("\n".join(found) if found else "what there was is there")
sys.exit(bool(found))
