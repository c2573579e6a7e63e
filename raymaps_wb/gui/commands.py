# SPDX-License-Identifier: LGPL-2.1-or-later
"""The commands of the workbench."""

import os

import FreeCAD
import FreeCADGui

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.errors import WorkbenchError
from raymaps_wb.export.check import check_study
from raymaps_wb.export.writer import export_study, file_stem
from raymaps_wb.gui.active import PREFIX, Transaction, active_study
from raymaps_wb.objects.catalogue import catalogue_names
from raymaps_wb.objects.detector import make_detector
from raymaps_wb.objects.medium import CATALOGUE, OWN, make_medium
from raymaps_wb.objects.references import set_references
from raymaps_wb.objects.source import make_source
from raymaps_wb.objects.study import make_study
from raymaps_wb.objects.surface_property import make_surface_property
from raymaps_wb.paths import icon


class Command:
    """Base: what FreeCAD asks for, from class attributes."""

    NAME, ICON, TEXT, TIP, KEY = "", "raymaps", "", "", ""

    def GetResources(self):
        resources = {"Pixmap": icon(self.ICON), "MenuText": translate(self.TEXT), "ToolTip": translate(self.TIP)}
        return {**resources, "Accel": self.KEY} if self.KEY else resources

    def IsActive(self):
        return FreeCAD.ActiveDocument is not None


class StudyCommand(Command):
    """Base of commands that work on a study."""

    def IsActive(self):
        return active_study() is not None


class NewStudy(Command):
    """Adds a study."""

    NAME, ICON, TEXT = "RayMaps_Study", "study", "New study"
    TIP = "Adds a study: the container of media, surface properties, sources and detectors of one simulation"

    def Activated(self):
        with Transaction(FreeCAD.ActiveDocument, "Ray Maps: new study") as document:
            study = make_study(document)
        FreeCADGui.Selection.clearSelection()
        from raymaps_wb.gui import dock

        dock.show(study)


class NewMember(StudyCommand):
    """Base of commands that add an object to the study and open its task panel."""

    def IsActive(self):
        return super().IsActive() and not FreeCADGui.Control.activeDialog()

    def make(self, document, study):
        """The new object."""
        raise NotImplementedError

    def Activated(self):
        from raymaps_wb.compat import primary_selection

        study = active_study()
        picked = [(obj, sub) for obj, sub in primary_selection() if not hasattr(getattr(obj, "Proxy", None), "TYPE")]
        placement = self.placement(picked)
        # The panel ends the step: making the object and editing it are one, and Cancel takes both back.
        study.Document.openTransaction(f"{PREFIX}{self.TEXT.lower()}")
        try:
            obj = self.make(study.Document, study)
            if "References" in obj.PropertiesList and picked:
                self.refer(obj, picked)
            if placement is not None and "Placement" in obj.PropertiesList:
                obj.Placement = placement
        except BaseException:
            study.Document.abortTransaction()
            raise
        obj.ViewObject.Proxy.edit_new(obj)

    def refer(self, obj, picked):
        """Take over what is selected."""
        set_references(obj, picked)

    def placement(self, picked):
        """Where the selection suggests to put the object; None: at the origin."""
        return


class NewSurfaceProperty(NewMember):
    """Adds a surface property."""

    NAME, ICON, TEXT = "RayMaps_SurfaceProperty", "surface_property", "New surface property"
    TIP = "Adds a surface property (mirror, matte, polished, coated, rough ...) for the selected bodies and faces"

    def make(self, document, study):
        return make_surface_property(document, study)


class NewMedium(NewMember):
    """Adds a medium."""

    NAME, ICON, TEXT = "RayMaps_Medium", "medium", "New medium"
    TIP = "Adds a medium (of the catalogue, own or from a file) that fills the selected bodies"

    def make(self, document, study):
        return make_medium(document, study, kind=CATALOGUE if catalogue_names() else OWN)


class NewSource(NewMember):
    """Adds a source."""

    NAME, ICON, TEXT = "RayMaps_Source", "source", "New source"
    TIP = "Adds a light source (point, beam, laser, sun, luminaire, ray file); with faces selected, they emit"

    def make(self, document, study):
        return make_source(document, study)

    def refer(self, obj, picked):
        faces = [(target, sub) for target, sub in picked if sub.split(".")[-1].startswith("Face")]
        if faces:
            obj.Kind = "Faces"
            set_references(obj, faces)


class NewDetector(NewMember):
    """Adds a detector."""

    NAME, ICON, TEXT = "RayMaps_Detector", "detector", "New detector"
    TIP = "Adds a detector: a rectangle, with a face selected just above it; or light on faces, or the far field"

    def make(self, document, study):
        from raymaps_wb.taskpanels.base import rectangle_on_selected_face

        detector, found = make_detector(document, study), rectangle_on_selected_face()
        if found is not None:
            detector.Placement, detector.Width, detector.Height = found
        return detector

    def placement(self, picked):
        from raymaps_wb.taskpanels.base import placement_on_selected_face, rectangle_on_selected_face

        return None if rectangle_on_selected_face() else placement_on_selected_face()


class Check(StudyCommand):
    """Lists what is wrong."""

    NAME, ICON, TEXT = "RayMaps_Check", "check", "Check study"
    TIP = "Tells in words everything that is wrong with the study before it runs"

    def Activated(self):
        study = active_study()
        problems = check_study(study)
        if not problems:
            FreeCAD.Console.PrintMessage(f"Ray Maps: nothing is wrong with '{study.Label}'.\n")
            QtWidgets.QMessageBox.information(
                FreeCADGui.getMainWindow(), translate("Check study"), translate("Nothing is wrong with this study.")
            )
            return
        FreeCADGui.Selection.clearSelection()
        for problem in problems:
            say = FreeCAD.Console.PrintError if problem.blocks else FreeCAD.Console.PrintWarning
            say(f"Ray Maps: {problem.text}\n")
            if problem.obj is not None:
                FreeCADGui.Selection.addSelection(problem.obj)
        marks = ["<li><b>" + p.text + "</b></li>" if p.blocks else "<li>" + p.text + "</li>" for p in problems]
        bold = f"<p>{translate('Bold: must be put right before a run.')}</p>" if problems[0].blocks else ""
        text = f"{bold}<ul>{''.join(marks)}</ul>"
        QtWidgets.QMessageBox.warning(FreeCADGui.getMainWindow(), translate("Check study"), text)


class Accuracy(StudyCommand):
    """Opens the panel that tells what accuracy costs."""

    NAME, ICON, TEXT = "RayMaps_Accuracy", "accuracy", "Accuracy"
    TIP = "Tells before a run how long it takes and how sure its figures are, and sets the number of rays"

    def IsActive(self):
        return super().IsActive() and not FreeCADGui.Control.activeDialog()

    def Activated(self):
        from raymaps_wb.taskpanels.accuracy import AccuracyPanel

        panel = AccuracyPanel(active_study())
        FreeCADGui.Control.showDialog(panel)
        panel.look()


class Run(StudyCommand):
    """Starts a run."""

    NAME, ICON, TEXT, KEY = "RayMaps_Run", "run", "Run", "R, M"
    TIP = "Simulates the study in a process of its own, with progress and cancel in the panel"

    def Activated(self):
        from raymaps_wb.gui import dock

        dock.show().run()


class Ask(StudyCommand):
    """Opens the panel for a criterion."""

    NAME, ICON, TEXT = "RayMaps_Ask", "ask", "Ask"
    TIP = "Opens the panel in which a criterion chooses the rays that are shown"

    def Activated(self):
        from raymaps_wb.gui import dock

        panel = dock.show()
        panel.criterion.setFocus()
        panel.criterion.lineEdit().selectAll()


class Report(StudyCommand):
    """Saves the report."""

    NAME, ICON, TEXT = "RayMaps_Report", "report", "Report"
    TIP = "Saves the report of the shown rays as HTML: every event of every ray"

    def Activated(self):
        from raymaps_wb.gui import dock

        panel = dock.show()
        if not panel.tabs.report_page:
            panel.apply()
            return
        path, _ = QtWidgets.QFileDialog.getSaveFileName(
            FreeCADGui.getMainWindow(), translate("Save report"), "rays.html", "HTML (*.html)"
        )
        if path:
            with open(path, "w", encoding="utf-8") as file:
                file.write(panel.tabs.report_page)


class Export(StudyCommand):
    """Writes the scene."""

    NAME, ICON, TEXT = "RayMaps_Export", "export", "Export scene"
    TIP = "Writes the study as a scene file with its geometry, for the command line and for Python"

    def Activated(self):
        study = active_study()
        start = os.path.join(
            os.path.dirname(study.Document.FileName) or os.path.expanduser("~"), file_stem(study.Label)
        )
        path, _ = QtWidgets.QFileDialog.getSaveFileName(
            FreeCADGui.getMainWindow(), translate("Export scene"), start + ".scene.json", "Scene (*.scene.json)"
        )
        if not path:
            return
        stem = os.path.basename(path)
        for ending in (".json", ".scene"):
            stem = stem[: -len(ending)] if stem.endswith(ending) else stem
        try:
            exported = export_study(study, os.path.dirname(path), stem)
        except WorkbenchError as error:
            FreeCAD.Console.PrintError(f"Ray Maps: {error}\n")
            QtWidgets.QMessageBox.warning(FreeCADGui.getMainWindow(), translate("Export scene"), str(error))
            return
        FreeCAD.Console.PrintMessage(f"Ray Maps: {exported.triangles} triangles written with {exported.path}\n")


class SetUpTracer(Command):
    """Opens the dialog that installs the tracer."""

    NAME, ICON, TEXT = "RayMaps_SetUpTracer", "setup", "Set up tracer"
    TIP = "Installs what the tracer needs into an environment of its own; asks before it uses the network"

    def IsActive(self):
        return True

    def Activated(self):
        from raymaps_wb.gui import dock, setup_dialog

        setup_dialog.show(FreeCADGui.getMainWindow())
        panel = dock.find()
        if panel is not None:
            panel.clear_obstacle()


COMMANDS = (
    NewStudy(),
    NewSurfaceProperty(),
    NewMedium(),
    NewSource(),
    NewDetector(),
    Check(),
    Accuracy(),
    Run(),
    Ask(),
    Report(),
    Export(),
    SetUpTracer(),
)


def register():
    """Tell FreeCAD of all commands; returns their names."""
    for command in COMMANDS:
        FreeCADGui.addCommand(command.NAME, command)
    return [command.NAME for command in COMMANDS]
