# SPDX-License-Identifier: LGPL-2.1-or-later
"""Files that objects speak of: kept relative to the document where they stand below its folder."""

import os


def absolute_path(document, path):
    """Where a file of a document is; what is not absolute counts from the document's folder."""
    if not path or os.path.isabs(path):
        return path
    return os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(document.FileName or ".")), path))


def kept_path(document, path):
    """A path as a document keeps it: relative to its folder if it lies below that, with slashes on all systems."""
    folder = os.path.dirname(os.path.abspath(document.FileName)) if document.FileName else ""
    if folder and path and os.path.abspath(path).startswith(folder + os.sep):
        path = os.path.relpath(path, folder)
    return path.replace(os.sep, "/")
