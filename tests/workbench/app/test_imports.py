# SPDX-License-Identifier: LGPL-2.1-or-later
"""The workbench imports only the standard library, FreeCAD and Qt; no compiled package, and never the tracer."""

import ast
import importlib
import os
import pkgutil
import sys
import unittest

import FreeCAD

import raymaps_wb

ALLOWED = {"FreeCAD", "FreeCADGui", "Part", "MeshPart", "PySide", "PySide2", "PySide6", "pivy", "freecad", "raymaps_wb"}
NEED_A_WINDOW = ("raymaps_wb.gui.", "raymaps_wb.viewproviders.", "raymaps_wb.taskpanels.")


def modules():
    return [module.name for module in pkgutil.walk_packages(raymaps_wb.__path__, "raymaps_wb.")]


class ImportsTest(unittest.TestCase):
    def test_every_module_imports_without_compiled_packages(self):
        for name in ("numpy", "pyarrow", "embreex", "raymaps"):
            with self.assertRaises(ImportError):
                importlib.import_module(name)
        names = modules()
        self.assertGreater(len(names), 30)
        for name in names:
            if FreeCAD.GuiUp or not name.startswith(NEED_A_WINDOW):
                importlib.import_module(name)
        for name in ("numpy", "pyarrow", "embreex", "numba", "raymaps"):
            self.assertIsNone(sys.modules[name], name)

    def test_only_allowed_packages_are_named(self):
        root = os.path.dirname(raymaps_wb.__path__[0])
        files = [os.path.join(folder, name) for folder, _, names in os.walk(raymaps_wb.__path__[0]) for name in names]
        files = [path for path in files if path.endswith(".py")]
        for path in [*files, os.path.join(root, "Init.py"), os.path.join(root, "InitGui.py")]:
            with open(path, encoding="utf-8") as file:
                text = file.read()
            self.assertIn("SPDX-License-Identifier: LGPL-2.1-or-later", text, path)
            self.assertNotIn("sys.path.insert", text, path)
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.ImportFrom):
                    self.assertEqual(node.level, 0, path)
                    names = [node.module]
                else:
                    names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                for name in names:
                    top = name.split(".")[0]
                    self.assertTrue(top in ALLOWED or top in sys.stdlib_module_names, f"{path} imports {name}")

    def test_icons_are_small(self):
        from raymaps_wb.paths import ICON_FOLDER

        icons = os.listdir(ICON_FOLDER)
        self.assertGreater(len(icons), 10)
        for name in icons:
            self.assertLessEqual(os.path.getsize(os.path.join(ICON_FOLDER, name)), 10_000, name)
