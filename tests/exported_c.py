"""Exported C, compiled with every warning an error."""

import ctypes
import shutil
import subprocess

import pytest

from pneumo.equations.system import system
from pneumo.export import exported

C_COMPILER = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-O1"]


def write(files, folder):
    """Write files and give the names of those in C."""
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return [name for name in files if name.endswith(".c")]


class CompiledModel:
    """A model in C at its own constants."""

    def __init__(self, model, n, plant, folder, precision="double", **parts):
        self.system = system(model, n, plant, **parts)
        source, _ = write(exported(model, n, plant, "c", precision=precision, **parts), folder)
        command = ["gcc", *STRICT, "-shared", "-fPIC", "-o", "model.so", source, "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        library = ctypes.CDLL(str(folder / "model.so"))
        self.real = ctypes.c_double if precision == "double" else ctypes.c_float
        name = self.system.name
        self._rates, self._step = library[f"{name}_rates"], library[f"{name}_step"]
        self._parameters = ctypes.byref(ctypes.c_char.in_dll(library, f"{name}_defaults"))

    def array(self, values):
        return (self.real * len(values))(*values)

    def rates(self, inputs, state):
        """Rates of the states."""
        rates = self.array(state)
        self._rates(self._parameters, self.array(inputs), self.array(state), rates)
        return list(rates)

    def step(self, start, end, h, state):
        """Whether a step failed, and the state after it."""
        after = self.array(state)
        arrays = self.array(start), self.array(end), self.real(h), after
        return self._step(self._parameters, *arrays), list(after)


class CompiledObserver:
    """An observer in C at its own constants and noise."""

    def __init__(self, model, n, plant, folder, sensors, precision="double"):
        files = exported(model, n, plant, "c", stem="m", precision=precision, observer=sensors)
        source, _ = write(files, folder)
        subprocess.run(
            ["gcc", *STRICT, "-shared", "-fPIC", "-o", "m.so", source, "-lm"], cwd=folder, check=True
        )
        self.library, self.system = ctypes.CDLL(str(folder / "m.so")), system(model, n, plant, piston=True)
        self.real = ctypes.c_double if precision == "double" else ctypes.c_float
        self.count = count = len(self.system.states)
        self.numbers = (self.real * (count + count**2))()
        defaults = ("defaults", "noise_defaults")
        self._known = [ctypes.byref(ctypes.c_char.in_dll(self.library, self._name(d))) for d in defaults]

    def _name(self, part):
        return f"{self.system.name}_{part}"

    def _call(self, part, *arguments):
        self.library[self._name(part)](*self._known, *arguments, self.numbers)

    def start(self, x, first):
        """Begin at rest at x with two pressures."""
        self._call("start", self.real(x), *map(self.real, first))

    def correct(self, readings):
        """Correct by readings; return states and their variances."""
        self._call("correct", (self.real * len(readings))(*readings))
        numbers, count = list(self.numbers), self.count
        return numbers[:count], numbers[count :: count + 1]

    def predict(self, u, h):
        """Predict the next sample."""
        self._call("predict", (self.real * 2)(u, 0.0), self.real(h))


def run_test_program(files, folder):
    """Exit code and output of the test program that goes with a model."""
    sources = write(files, folder)
    subprocess.run(["gcc", *STRICT, "-o", "program", *sources, "-lm"], cwd=folder, check=True)
    ran = subprocess.run(["./program"], cwd=folder, capture_output=True, text=True)
    return ran.returncode, ran.stdout
