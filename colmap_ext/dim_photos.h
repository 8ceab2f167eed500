// Photos of 16 bits that hold values of 10, 12 or 14: of the 8 bits that matching takes hardly a grey level would be left.
#pragma once

#include <string>
#include <vector>

#include "colmap_ext/workspace.h"

namespace colmap_ext {

class DimPhotos {
 public:
  // Those to be looked at: indices into Workspace::views().
  DimPhotos(const Workspace& workspace, std::vector<int> images);

  int size() const { return static_cast<int>(images_.size()); }
  // The i-th of them. Safe to call concurrently for different ones. A photo that cannot be decoded is left out: it is told where it
  // is used.
  void Look(int i, const PhotoFile& photo);
  // What is to be said of those that are dim; empty where none is.
  std::string Describe() const;

 private:
  const Workspace& workspace_;
  std::vector<int> images_, brightest_;
};

// Of the first, the middle and the last image: photos of one camera are alike, and to decode all takes long.
std::string DescribeDimPhotosOfSome(const Workspace& workspace);

}  // namespace colmap_ext
