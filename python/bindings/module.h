// The parts of the module phimvs._core. The package's Python files say what users may call.
#pragma once

#include <nanobind/nanobind.h>

#include <string>

#include "phi/base/message.h"

namespace phimvs_python {

// Names of files and images are bytes: as os.fsdecode makes a str of them, which open() takes.
nanobind::str TextOf(const std::string& text);
// (text, file, image, stage), '' for what is not named.
nanobind::tuple TupleOf(const phi::Message& message);

void BindArrays(nanobind::module_& module);
void BindCloudFile(nanobind::module_& module);
void BindCommands(nanobind::module_& module);
void BindMaps(nanobind::module_& module);
void BindScene(nanobind::module_& module);

}  // namespace phimvs_python
