#include "colmap_ext/fusion/bounding_box_file.h"

#include <fstream>

#include "colmap_ext/input_file.h"
#include "phi/base/error.h"

namespace colmap_ext {

phi::BoundingBox ReadBoundingBox(const std::filesystem::path& path) {
  std::ifstream file = OpenRegularFile(path);
  if (!file) throw phi::InputError(phi::AboutFile(path) + ": this bounding box cannot be read");
  phi::BoundingBox box;
  for (double* corner : {box.min, box.max}) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(file >> corner[axis])) {
        throw phi::InputError(phi::AboutFile(path) +
                              ": a bounding box is six numbers, min_x min_y min_z max_x max_y max_z");
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!(box.min[axis] <= box.max[axis])) {
      throw phi::InputError(phi::AboutFile(path) + ": the first corner must be the smaller one in x, y and z");
    }
  }
  return box;
}

}  // namespace colmap_ext
