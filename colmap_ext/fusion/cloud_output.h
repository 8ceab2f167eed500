// The file or files that a cloud goes to: format, coordinates, tiles.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/workspace.h"
#include "phi/base/option.h"

namespace colmap_ext {

enum class CloudType { kBySuffix, kPly, kLas, kBinary, kText };

struct CloudOutput {
  std::filesystem::path path;  // the file, or the folder of a sparse model
  CloudType type = CloudType::kBySuffix;
  std::string crs;       // WKT of the world's coordinate system, or a file that holds it; LAS alone
  double tile_size = 0;  // world units; 0: one file

  // All but the path.
  phi::OptionList List();
  // Finds the type and reads the coordinate system. Throws phi::UsageError, phi::InputError.
  void Resolve();
  bool IsFile() const { return type == CloudType::kPly || type == CloudType::kLas; }
};

// Removes what an earlier run left of a cloud of this name in the other form: tiles where there is one file now, that file where there
// are tiles. After the writer's Commit: until then the earlier cloud is the only one.
void RemoveOtherForm(const CloudOutput& output);

// `output` is resolved. Throws phi::InputError where the place cannot be written.
std::unique_ptr<CloudWriter> MakeCloudWriter(const Workspace& workspace, const CloudOutput& output);

}  // namespace colmap_ext
