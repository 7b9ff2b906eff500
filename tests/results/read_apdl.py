"""Reads JOB.mac as ANSYS would: only the commands that rfem writes, and none it does not know.

`read(path, frame)` gives what ANSYS would show after `*USE,JOB.mac,FRAME`;
`python read_apdl.py JOB.mac [FRAME]` sums it up.
"""

import sys
from dataclasses import dataclass, field


@dataclass
class Model:
    """What stands in ANSYS's database after the macro has run."""

    parameters: dict = field(default_factory=dict)
    title: str = ""
    nodes: dict = field(default_factory=dict)  # id -> (x, y)
    types: dict = field(default_factory=dict)  # number -> (element name, key options)
    elements: dict = field(default_factory=dict)  # id -> (type number, material, node ids)
    components: dict = field(default_factory=dict)  # name -> element ids
    displacement: dict = field(default_factory=dict)  # node id -> (ux, uy)
    stress: dict = field(default_factory=dict)  # element id -> (sx, sy, sz, sxy, syz, sxz)
    solved: bool = False
    processor: str = ""
    type: int = 1
    material: int = 1
    selected: list = field(default_factory=list)

    def triangles(self):
        """Ids of the solid elements with their three nodes."""
        return {k: n[:3] for k, (t, _, n) in self.elements.items() if self.types[t][0] == "PLANE182"}

    def interfaces(self, component):
        """Node ids of the two sides of each broken interface: lines follow each other in pairs."""
        lines = [self.elements[k][2] for k in self.components.get(component, [])]
        assert len(lines) % 2 == 0
        return list(zip(lines[::2], lines[1::2]))


COMPARE = {"GE": float.__ge__, "LE": float.__le__, "EQ": float.__eq__, "LT": float.__lt__, "GT": float.__gt__}


def read(path, frame=0):
    """Run the macro with ARG1 = frame."""
    model = Model(parameters={"ARG1": float(frame)})
    skipping = inside = False
    with open(path) as file:
        for line in file:
            assert len(line) <= 640, "ANSYS reads 640 characters a line"
            line = line.split("!")[0].strip()
            if not line:
                continue
            words = [word.strip() for word in line.split(",")]
            command = words[0].upper()
            if command == "*IF":
                assert not inside, "conditions do not nest here"
                inside, skipping = True, not condition(model, words[1:])
            elif command == "*ENDIF":
                assert inside
                inside = skipping = False
            elif not skipping:
                execute(model, command, words[1:], line)
    assert not inside
    return model


def condition(model, words):
    def value(word):
        return float(model.parameters[word]) if word in model.parameters else float(word)

    truth = COMPARE[words[1]](value(words[0]), value(words[2]))
    if words[3] == "THEN":
        return truth
    other = COMPARE[words[5]](value(words[4]), value(words[6]))
    assert words[7] == "THEN"
    return (truth and other) if words[3] == "AND" else (truth or other)


def execute(model, command, words, line):
    if "=" in line and not line.startswith("/"):
        name, value = (word.strip() for word in line.split("="))
        model.parameters[name] = model.parameters.get(value) if value in model.parameters else float(value)
    elif command in ("/PREP7", "/SOLU", "/POST1"):
        assert model.processor == "" or command == model.processor, "FINISH is missing"
        model.processor = command
    elif command == "FINISH":
        model.processor = ""
    elif command == "/TITLE":
        model.title = line.split(",", 1)[1]
    elif command in ("ALLSEL", "ANTYPE", "D", "DDELE", "/GRAPHICS", "MP"):
        pass
    elif model.processor == "/PREP7":
        define(model, command, words)
    elif command == "SOLVE" and model.processor == "/SOLU":
        model.solved = True
    elif model.processor == "/POST1":
        result(model, command, words)
    else:
        raise ValueError(f"unknown command, or in the wrong place: {line}")


def define(model, command, words):
    if command == "EDELE":
        model.elements.clear()
    elif command == "NDELE":
        assert not model.elements
        model.nodes.clear()
    elif command == "ET":
        model.types[int(words[0])] = (words[1], words[2:])
    elif command == "TYPE":
        model.type = int(words[0])
    elif command == "MAT":
        model.material = int(words[0])
    elif command == "N":
        model.nodes[int(words[0])] = (float(words[1]), float(words[2]))
    elif command in ("EN", "E"):
        number = int(words.pop(0)) if command == "EN" else max(model.elements, default=0) + 1
        nodes = [int(word) for word in words]
        assert number not in model.elements and all(node in model.nodes for node in nodes)
        if model.types[model.type][0] == "PLANE182":
            assert len(nodes) == 4 and nodes[2] == nodes[3], "the triangle gives its third node twice"
        else:
            assert model.types[model.type][0] == "MESH200" and len(nodes) == 2
        model.elements[number] = (model.type, model.material, nodes)
    elif command == "ESEL":
        model.selected = [
            k for k in sorted(model.elements) if words[0] == "ALL" or model.elements[k][0] == int(words[3])
        ]
    elif command == "CM":
        assert model.selected and words[1] == "ELEM"
        model.components[words[0]] = model.selected
    else:
        raise ValueError(f"unknown in PREP7: {command}")


def result(model, command, words):
    if command == "SET":
        assert model.solved, "POST1 has no results to change"
    elif command == "DNSOL":
        assert int(words[0]) in model.nodes and words[1:3] == ["U", "X"]
        model.displacement[int(words[0])] = tuple(float(word) for word in words[3:5])
    elif command == "DESOL":
        assert int(words[0]) in model.elements and words[1:4] == ["ALL", "S", "X"] and len(words) == 10
        model.stress[int(words[0])] = tuple(float(word) for word in words[4:])
    else:
        raise ValueError(f"unknown in POST1: {command}")


if __name__ == "__main__":
    shown = read(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    print(
        f"{shown.title}: {len(shown.nodes)} nodes, {len(shown.triangles())} triangles, "
        + ", ".join(f"{len(ids) // 2} in {name}" for name, ids in sorted(shown.components.items()))
    )
