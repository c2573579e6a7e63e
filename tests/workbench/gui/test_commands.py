# SPDX-License-Identifier: LGPL-2.1-or-later
"""Commands, task panels and what the objects look like."""

from unittest import mock

import FreeCAD
import FreeCADGui

from gui.window import WindowTest, spin, wait_until
from raymaps_wb.compat import QtWidgets
from raymaps_wb.gui import dock
from raymaps_wb.gui.active import Transaction
from raymaps_wb.gui.commands import COMMANDS
from raymaps_wb.gui.examples import criteria, quoted
from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import set_scatterers
from raymaps_wb.objects.references import reference_list
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import members, studies
from raymaps_wb.taskpanels.base import ObjectPanel


class CommandsTest(WindowTest):
    def edit(self, obj):
        """Open the object's task panel."""
        FreeCADGui.getDocument(obj.Document.Name).setEdit(obj.Name, 0)
        return obj.ViewObject.Proxy.panel(obj)

    def close_panel(self):
        FreeCADGui.getDocument(self.document.Name).resetEdit()
        FreeCADGui.Control.closeDialog()

    def test_every_command_is_known_with_its_icon(self):
        known = FreeCADGui.listCommands()
        for command in COMMANDS:
            self.assertIn(command.NAME, known)
            resources = command.GetResources()
            self.assertTrue(resources["MenuText"] and resources["ToolTip"])
            with open(resources["Pixmap"], encoding="utf-8") as file:
                self.assertIn("<svg", file.read())

    def test_new_objects_take_the_selection_and_can_be_undone(self):
        box = self.box()
        self.document.recompute()
        FreeCADGui.runCommand("RayMaps_Study")
        study = studies(self.document)[0]
        for command, member, sub in (
            ("RayMaps_Medium", "RayMaps::Medium", ""),
            ("RayMaps_SurfaceProperty", "RayMaps::SurfaceProperty", "Face2"),
            ("RayMaps_Source", "RayMaps::Source", "Face6"),
        ):
            FreeCADGui.Selection.clearSelection()
            FreeCADGui.Selection.addSelection(self.document.Name, box.Name, sub)
            FreeCADGui.runCommand(command)
            self.close_panel()
            self.assertEqual([reference_list(obj) for obj in members(study, member)], [[(box, sub)]], command)
        source = members(study, "RayMaps::Source")[0]
        self.assertEqual(source.Kind, "Faces")
        FreeCADGui.Selection.clearSelection()
        FreeCADGui.Selection.addSelection(self.document.Name, box.Name, "Face6")
        FreeCADGui.runCommand("RayMaps_Detector")
        self.close_panel()
        detector = members(study, "RayMaps::Detector")[0]
        self.assertAlmostEqual(detector.Placement.Base.z, 30.05)
        self.assertAlmostEqual(detector.Placement.Rotation.multVec(FreeCAD.Vector(0, 0, 1)).z, 1)
        for n_left in (3, 2, 1, 0):
            self.document.undo()
            self.assertEqual(len(study.Group), n_left)
        self.document.undo()
        self.assertEqual(studies(self.document), [])

    def new(self, command):
        """Press a command that makes an object; the task panel that it opened."""
        FreeCADGui.Selection.clearSelection()
        before = set(studies(self.document)[0].Group)
        with mock.patch.object(ObjectPanel, "begin", autospec=True, side_effect=ObjectPanel.begin) as begin:
            FreeCADGui.runCommand(command)
        spin(0.05)
        (obj,) = set(studies(self.document)[0].Group) - before
        return obj, begin.call_args[0][0]

    def test_a_new_detector_covers_the_plane_face_that_is_selected(self):
        study, _, _ = self.full_study()
        for i, (axis, angle_deg) in enumerate((((0, 0, 1), 0), ((0, 0, 1), 30), ((1, 2, 3), 70))):
            box = self.box(f"Turned{i}")
            box.Placement = self.placement(100, 50, 200 * i, axis, angle_deg)
            self.document.recompute()
            middle, out = box.Placement.multVec(self.vector(5, 10, 30.05)), box.Placement.Rotation
            FreeCADGui.Selection.clearSelection()
            FreeCADGui.Selection.addSelection(self.document.Name, box.Name, "Face6")
            FreeCADGui.runCommand("RayMaps_Detector")
            self.close_panel()
            detector = members(study, "RayMaps::Detector")[-1]
            self.assertEqual(sorted([round(float(detector.Width), 5), round(float(detector.Height), 5)]), [10, 20])
            self.assertLess(detector.Placement.Base.distanceToPoint(middle), 1e-6)
            turned = detector.Placement.Rotation
            self.assertAlmostEqual(turned.multVec(self.vector(0, 0, 1)) * out.multVec(self.vector(0, 0, 1)), 1)
            if angle_deg == 0:
                self.assertEqual((float(detector.Width), turned.Angle), (10, 0))
        disc = self.document.addObject("Part::Cylinder", "Disc")
        self.document.recompute()
        FreeCADGui.Selection.clearSelection()
        FreeCADGui.Selection.addSelection(self.document.Name, disc.Name, "Face2")
        FreeCADGui.runCommand("RayMaps_Detector")
        self.close_panel()
        self.assertAlmostEqual(float(members(study, "RayMaps::Detector")[-1].Width), 4, places=3)
        FreeCADGui.Selection.clearSelection()
        FreeCADGui.Selection.addSelection(self.document.Name, disc.Name, "Face1")
        FreeCADGui.runCommand("RayMaps_Detector")
        self.close_panel()
        self.assertEqual(float(members(study, "RayMaps::Detector")[-1].Width), 10)

    def test_cancel_takes_a_new_object_away(self):
        study, _, _ = self.full_study()
        before = [obj.Name for obj in self.document.Objects]
        for name in ("SurfaceProperty", "Medium", "Source", "Detector"):
            _, panel = self.new("RayMaps_" + name)
            self.assertTrue(panel.reject())
            FreeCADGui.Control.closeDialog()
            spin(0.05)
            self.assertEqual([obj.Name for obj in self.document.Objects], before, name)
            self.assertEqual(len(study.Group), 4)

    def test_cancel_takes_a_new_object_away_after_a_run_was_kept(self):
        study, _, _ = self.full_study()
        _, panel = self.new("RayMaps_Source")
        with Transaction(self.document, "Ray Maps: edit something else"):
            pass
        self.document.commitTransaction()
        panel.reject()
        self.assertEqual(len(members(study, "RayMaps::Source")), 1)

    def test_making_and_editing_is_one_step(self):
        study, _, _ = self.full_study()
        source, panel = self.new("RayMaps_Source")
        panel.editors["FluxW"].widget.setText("x")
        self.assertFalse(panel.accept())
        self.assertIn(source, study.Group)
        panel.editors["FluxW"].widget.setText("7")
        self.assertTrue(panel.accept())
        self.assertEqual((source.FluxW, len(study.Group)), (7, 5))
        self.document.undo()
        self.assertEqual(len(study.Group), 4)
        self.document.redo()
        self.assertEqual(members(study, "RayMaps::Source")[-1].FluxW, 7)

    def test_cancel_takes_back_where_an_object_was_put(self):
        study, lens, _ = self.full_study()
        detector = members(study, "RayMaps::Detector")[0]
        panel = self.edit_as_users_do(detector)
        FreeCADGui.Selection.clearSelection()
        FreeCADGui.Selection.addSelection(self.document.Name, lens.Name, "Face6")
        panel._put_on_face(1)
        self.assertAlmostEqual(detector.Placement.Base.z, 30.05)
        panel.reject()
        FreeCADGui.Control.closeDialog()
        self.assertEqual(detector.Placement.Base.z, 0)

    def edit_as_users_do(self, obj):
        """Double-click an object; the task panel that opened."""
        with mock.patch.object(ObjectPanel, "begin", autospec=True, side_effect=ObjectPanel.begin) as begin:
            obj.ViewObject.Proxy.doubleClicked(obj.ViewObject)
        return begin.call_args[0][0]

    def test_task_panels_write_as_one_step(self):
        study, _, _ = self.full_study()
        source = members(study, "RayMaps::Source")[0]
        panel = self.edit(source)
        panel.editors["Kind"].widget.setCurrentText("Cone")
        panel.editors["FluxW"].widget.setText("2.5")
        panel.editors["RGB"].widget.setText("1 0.5 0")
        panel.editors["HalfAngle"].widget.setProperty("value", FreeCAD.Units.Quantity("33 deg"))
        self.assertTrue(panel.accept())
        self.assertEqual((source.Kind, source.FluxW, list(source.RGB)), ("Cone", 2.5, [1, 0.5, 0]))
        self.assertAlmostEqual(float(source.HalfAngle), 33)
        self.document.undo()
        self.assertEqual((source.Kind, source.FluxW), ("Point", 1.0))

    def test_task_panels_refuse_what_is_no_number(self):
        study, _, _ = self.full_study()
        medium = members(study, "RayMaps::Medium")[0]
        panel = self.edit(medium)
        panel.editors["AbsorptionPerMm"].widget.setText("a lot")
        panel.editors["RefractiveIndex"].widget.setText("1.7")
        self.assertFalse(panel.accept())
        self.assertIn("'a' is not a number", panel._message.text())
        self.assertAlmostEqual(medium.RefractiveIndex, 1.4914)
        self.close_panel()

    def test_every_task_panel_opens_and_writes_back_what_it_showed(self):
        from raymaps_wb.export.fingerprint import fingerprint

        study = self.open_example("singlet_barrel")
        # Another version of FreeCAD than that of the file may cut faces otherwise when it recomputes.
        study.Document.recompute(None, True)
        before = fingerprint(study)
        for obj in [study, *study.Group]:
            panel = self.edit(obj)
            spin(0.05)
            self.assertIsNotNone(FreeCADGui.Control.activeDialog())
            self.assertTrue(panel.accept(), obj.Label)
        self.assertEqual(fingerprint(study), before)

    def test_mixture_panel(self):
        study = self.open_example("singlet_barrel")
        paint = next(obj for obj in study.Group if obj.Label == "black_paint")
        panel = self.edit(paint)
        rows = {panel._table.item(row, 0).text(): row for row in range(panel._table.rowCount())}
        panel._table.item(rows["matte"], 1).setText("0.5")
        panel._table.item(rows["absorbing"], 1).setText("0.5")
        panel._table.item(rows["gloss"], 1).setText("0")
        self.assertTrue(panel.accept())
        self.assertEqual([part.Label for part in paint.Parts], ["absorbing", "matte"])
        self.assertEqual(list(paint.Weights), [0.5, 0.5])

    def test_sources_and_detectors_are_drawn(self):
        study, _, _ = self.full_study()
        for kind in ("Point", "Cone", "Disc"):
            source = make_source(self.document, study, kind, kind)
            self.assertGreater(source.ViewObject.Proxy.root.getNumChildren(), 0, kind)
        detector = members(study, "RayMaps::Detector")[0]
        detector.Placement.Base = self.vector(0, 0, 80)
        spin(0.2)
        view = FreeCADGui.activeDocument().activeView()
        view.setAnimationEnabled(False)
        view.viewIsometric()
        view.fitAll()
        shown = self.picture("a.png")
        detector.ViewObject.Visibility = False
        self.assertNotEqual(shown, self.picture("b.png"))

    def test_arrows_of_emitting_faces_follow_the_faces(self):
        study = self.open_example("led_collimator")
        source = next(obj for obj in study.Group if obj.Label == "LED_red")

        def first_point():
            root = source.ViewObject.Proxy.root
            found = [root.getChild(i) for i in range(root.getNumChildren())]
            points = [node.point for node in found if node.getTypeId().getName().getString() == "Coordinate3"]
            return tuple(points[0].getValues()[0].getValue()) if points else None

        self.assertTrue(wait_until(first_point, 5))
        z = first_point()[2]
        self.assertAlmostEqual(z, 60, places=4)
        study.Document.getObject("Luminaire").Placement.Base.z += 5
        study.Document.recompute()
        self.assertTrue(wait_until(lambda: abs(first_point()[2] - z - 5) < 1e-3, 5))

    def test_one_panel(self):
        self.assertIs(dock.show(), dock.show())
        found = [
            w for w in FreeCADGui.getMainWindow().findChildren(QtWidgets.QDockWidget) if w.objectName() == dock.NAME
        ]
        self.assertEqual(len(found), 1)

    def test_suggested_criteria_are_made_of_the_study_s_names(self):
        study, _, _ = self.full_study()
        members(study, "RayMaps::Source")[0].Label = 'the "lamp"'
        self.assertIn('from("the \\"lamp\\"")', criteria(study))
        self.assertIn("detector(Detector)", criteria(study))
        make_detector(self.document, study, "Sky", "Far field")
        set_scatterers(members(study, "RayMaps::Medium")[0], [("Isotropic", "1", 0.0, "")])
        self.assertIn("detector(Sky)", criteria(study))
        self.assertIn("medium(PMMA, scattering)", criteria(study))
        self.assertEqual([quoted(name) for name in ("a_1", "1a", "ä")], ["a_1", '"1a"', '"ä"'])
