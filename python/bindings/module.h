// The parts of the module phimvs._core. The package's Python files say what users may call.
#pragma once

#include <nanobind/nanobind.h>

namespace phimvs_python {

void BindArrays(nanobind::module_& module);
void BindCommands(nanobind::module_& module);
void BindMaps(nanobind::module_& module);

}  // namespace phimvs_python
