# SPDX-License-Identifier: LGPL-2.1-or-later
"""Compiled loops over the rays of a portion, one file a stage. They know arrays only: no files, no scene.

Every stage runs over the same *wave* (see `raymaps.wave.Wave`) and the same tables (`raymaps.compile.Tables`).
A stage of an effect has one function, `run(active, wave, tables, data, key, depth)`; data is what the effect's `lower`
gives. One on the way whose rays go on from there has a second, `scatter`, with the same arguments.
"""
