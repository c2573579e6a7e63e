# SPDX-License-Identifier: LGPL-2.1-or-later
"""Layers of a thin film, from the outside of the body inwards."""

from raymaps_wb.compat import QtWidgets, translate
from raymaps_wb.objects.catalogue import catalogue
from raymaps_wb.objects.medium import CATALOGUE, Medium, make_medium
from raymaps_wb.objects.study import members, study_of
from raymaps_wb.taskpanels.lists import ListEditor

QUARTER_WAVE_NM = 99.6  # of MgF2 at 550 nm
USUAL = "MgF2"


class LayersEditor(ListEditor):
    """Medium and thickness of each layer. A medium of the catalogue that the study lacks is added to it by OK."""

    HEADINGS = ("Layer", "nm")
    ORDERED = True
    ADD = translate("Add layer")

    def __init__(self, obj, prop):
        super().__init__()
        self.prop, self._study = prop, study_of(obj)
        self._media = members(self._study, Medium.TYPE) if self._study is not None else []
        header = self.widget.horizontalHeader()
        header.setSectionResizeMode(1, QtWidgets.QHeaderView.Fixed)
        header.resizeSection(1, 75)
        layers = [(layer, "", nm) for layer, nm in zip(obj.LayerMedia, obj.LayerThicknessNm, strict=False)]
        self.set_rows(layers or [self.new_values()])  # a common antireflection coating to begin with

    def new_values(self):
        return (None, USUAL, QUARTER_WAVE_NM)

    def widgets(self, values):
        medium, name, thickness_nm = values
        media = QtWidgets.QComboBox()
        media.setToolTip(translate("A medium of the study, or one of the catalogue, which is then added to the study"))
        media.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        for known in self._media:
            media.addItem(known.Label, (known.Name, ""))
        for group, names in catalogue().items():
            media.insertSeparator(media.count())
            for other in names:
                media.addItem(f"{other}  ({group.lower()})", ("", other))
        wanted = (medium.Name, "") if medium is not None else ("", name)
        at = next((i for i in range(media.count()) if tuple(media.itemData(i) or ()) == wanted), 0)
        media.setCurrentIndex(at)
        nm = QtWidgets.QLineEdit(thickness_nm if isinstance(thickness_nm, str) else f"{thickness_nm:.12g}")
        nm.setToolTip(translate("Thickness in nm; a quarter wave is the wavelength divided by four times the index"))
        nm.setFrame(False)
        return media, nm

    def values_of(self, widgets):
        media, nm = widgets
        name, of_catalogue = tuple(media.currentData() or ("", ""))
        medium = next((known for known in self._media if known.Name == name), None)
        return (medium, of_catalogue, nm.text())

    def value(self):
        """Check what was typed; raises ValueError in words."""
        rows = self.rows()
        if not rows:
            raise ValueError("Thin film: add its layers, from the outside of the body inwards.")
        for i, (medium, name, text) in enumerate(rows, 1):
            if medium is None and not name:
                raise ValueError(f"Layer {i}: make a medium for it first; the study has none.")
            if not _number(text) > 0:
                raise ValueError(f"Layer {i}: its thickness must be a number of nm above 0, got '{text}'.")

    def write(self, obj):
        """Write the layers; the media that they bring into the study first."""
        added, media = {}, []
        for medium, name, _ in self.rows():
            if medium is None and name not in added:
                known = [other for other in self._media if other.Kind == CATALOGUE and other.Catalogue == name]
                added[name] = known[0] if known else self._new(obj.Document, name)
            media.append(medium if medium is not None else added[name])
        obj.LayerMedia = media
        obj.LayerThicknessNm = [_number(text) for _, _, text in self.rows()]

    def _new(self, document, name):
        medium = make_medium(document, self._study, name, kind=CATALOGUE)
        medium.Catalogue = name
        return medium


def _number(text):
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return -1.0
