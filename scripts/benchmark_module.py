"""scripts/benchmark as a module, whose file name no import statement can say."""
import importlib.machinery
import importlib.util
import sys
from pathlib import Path


def load_benchmark():
    path = Path(__file__).resolve().with_name("benchmark")
    loader = importlib.machinery.SourceFileLoader("benchmark", str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("benchmark", loader))
    sys.dont_write_bytecode = True
    loader.exec_module(module)
    return module


benchmark = load_benchmark()
