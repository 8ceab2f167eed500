#include "colmap_ext/fusion/bounding_box_file.h"

#include <fstream>
#include <iterator>
#include <string>

#include "colmap_ext/config_lines.h"
#include "colmap_ext/input_file.h"
#include "colmap_ext/text_stream.h"
#include "phi/base/error.h"

namespace colmap_ext {

phi::BoundingBox ReadBoundingBox(const std::filesystem::path& path) {
  std::ifstream file = OpenNeededFile(path);
  const std::string content(std::istreambuf_iterator<char>(file), {});
  RequireUtf8(path, content);
  TextInput numbers(content.starts_with(kByteOrderMark) ? content.substr(kByteOrderMark.size()) : content);
  const phi::InputError other_content(
      phi::AboutFile(path) + ": a bounding box is six numbers with decimal points and no more, min_x min_y min_z max_x max_y max_z");
  phi::BoundingBox box;
  for (double* corner : {box.min, box.max}) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(numbers >> corner[axis])) throw other_content;
    }
  }
  if (!(numbers >> std::ws).eof()) throw other_content;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(box.min[axis] <= box.max[axis])) {
      throw phi::InputError(phi::AboutFile(path) + ": the first corner must be the smaller one in x, y and z");
    }
  }
  return box;
}

}  // namespace colmap_ext
