#include "colmap_ext/fusion/fusion_map_reader.h"

#include <tbb/parallel_invoke.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "colmap_ext/format_text.h"
#include "colmap_ext/image_file.h"
#include "colmap_ext/map_shape.h"
#include "colmap_ext/mask_file.h"
#include "colmap_ext/measurement_file.h"
#include "colmap_ext/plane_channels.h"
#include "colmap_ext/thinning.h"
#include "phi/base/error.h"
#include "phi/base/whole_array.h"
#include "phi/base/wide_vectors.h"

namespace colmap_ext {
namespace {

namespace fs = std::filesystem;

// function(value, pixel) for the map's pixels and what the mask, of any size, holds there.
template <typename Function>
void ForPixels(const phi::Mask& mask, phi::FusionMap* map, const Function& function) {
  std::vector<int> columns(static_cast<std::size_t>(map->width()));
  for (int x = 0; x < map->width(); ++x) columns[static_cast<std::size_t>(x)] = NearestPixel(x, map->width(), mask.width());
  phi::ForRows(map->height(), [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const std::uint8_t* values = &mask(0, NearestPixel(y, map->height(), mask.height()));
      phi::FusionPixel* pixels = &(*map)(0, y);
      for (std::size_t x = 0; x < columns.size(); ++x) function(values[columns[x]], pixels[x]);
    }
  });
}

bool IsAboutUnit(phi::Vec3f normal) {
  const float squared_norm = phi::Dot(normal, normal);
  return (squared_norm > 0.25f) & (squared_norm < 4.0f);
}

// In place of a component of what is not of about unit length, another.
PHI_WIDE_VECTORS void CopyOfUnit(const float* x, const float* y, const float* z, const float* component, float other, std::size_t size,
                                 float* copy) {
  for (std::size_t i = 0; i < size; ++i) copy[i] = IsAboutUnit({x[i], y[i], z[i]}) ? component[i] : other;
}

PHI_WIDE_VECTORS void PackAxes(const float* along, const float* across, const float* z, std::size_t size, std::int16_t* packed) {
  for (std::size_t i = 0; i < size; ++i) packed[i] = phi::PackAxis(along[i], across[i], z[i]);
}

// The normals of a row.
class PackedRow {
 public:
  explicit PackedRow(std::size_t size) : normals_(size), x_(size), y_(size) {}

  // Those of about unit length; the others' are of no use.
  void Pack(const float* const normal[3]) {
    float *const x = normals_.x.data(), *const y = normals_.y.data(), *const z = normals_.z.data();
    for (const auto& [c, copy] : {std::pair{0, x}, {1, y}, {2, z}})
      CopyOfUnit(normal[0], normal[1], normal[2], normal[c], c == 2 ? 1.0f : 0.0f, x_.size(), copy);
    PackAxes(x, y, z, x_.size(), x_.data());
    PackAxes(y, x, z, y_.size(), y_.data());
  }
  phi::PackedNormal operator[](std::size_t i) const { return {x_[i], y_[i]}; }

 private:
  PlaneChannels normals_;
  std::vector<std::int16_t> x_, y_;
};

}  // namespace

phi::PackedNormal PackChecked(phi::Vec3f normal, const phi::RayModel& rays, int x, int y) {
  if (IsAboutUnit(normal)) return phi::PackNormal(normal);
  const phi::Vec3f ray = rays.Ray(x + 0.5f, y + 0.5f);
  return phi::PackNormal({-ray.x, -ray.y, -ray.z});
}

phi::Message NoFolderOfFusionMasks(const fs::path& folder) {
  return "--StereoFusion.mask_path: there is no folder " + phi::AboutFile(folder);
}

FusionMapReader::FusionMapReader(const Workspace& workspace, FusionInput input, HandedMaps* handed)
    : workspace_(workspace), input_(std::move(input)), handed_(handed) {
  if (!input_.mask_path.empty() && !fs::is_directory(input_.mask_path)) {
    throw phi::InputError(NoFolderOfFusionMasks(input_.mask_path));
  }
}

fs::path FusionMapReader::MaskPath(int image) const { return workspace_.MaskPathIn(input_.mask_path, image); }

bool FusionMapReader::Exists(int image) const {
  if (Handed(image).map != nullptr || fs::exists(CompactPath(image))) return true;
  return fs::exists(workspace_.DepthMapPath(image, input_.kind)) &&
         fs::exists(workspace_.NormalMapPath(image, input_.kind));
}

MapSize FusionMapReader::ReadSize(int image) const {
  if (const auto map = Handed(image).map; map != nullptr) return {map->width(), map->height(), 1};
  if (const fs::path path = CompactPath(image); fs::exists(path)) return ReadCompactMapSize(path);
  const fs::path path = workspace_.DepthMapPath(image, input_.kind);
  const fs::path normal_path = workspace_.NormalMapPath(image, input_.kind);
  const MapSize size = ReadMapSize(path), normal_size = ReadMapSize(normal_path);
  if (size.channels != 1 || normal_size.channels != 3) {
    throw phi::InputError(phi::AboutFile(size.channels != 1 ? path : normal_path) +
                          ": a depth map has one channel and a normal map three; estimate this image again");
  }
  if (size.width != normal_size.width || size.height != normal_size.height) {
    throw phi::InputError(phi::AboutFile(path) + ": this map is " + SizeText(size.width, size.height) +
                          ", but the image's normal map is " +
                          SizeText(normal_size.width, normal_size.height) + "; estimate this image again");
  }
  return size;
}

phi::Camera FusionMapReader::ReadCamera(int image) const { return CameraOf(image, ReadSize(image)); }

phi::Camera FusionMapReader::CameraOf(int image, const MapSize& size) const {
  phi::Camera camera = workspace_.views()[static_cast<std::size_t>(image)].camera;
  const phi::Pinhole of_map = CameraOfMap(camera.pinhole, size.width, size.height,
                                          phi::AboutFile(workspace_.DepthMapPath(image, input_.kind)));
  if (!(input_.downsize && size.width > camera.pinhole.width)) camera.pinhole = of_map;
  return camera;
}

phi::FusionMap FusionMapReader::Read(int image) const {
  const MapSize size = ReadSize(image);
  const phi::Pinhole pinhole = CameraOf(image, size).pinhole;
  HandedImage handed = Handed(image);
  if (handed.map == nullptr && fs::exists(CompactPath(image)))
    handed.map = std::make_shared<const phi::MeasurementMap>(ReadCompactMap(CompactPath(image)));
  phi::FusionMap map(pinhole.width, pinhole.height);
  ColorImage colors;
  phi::Mask states;
  tbb::parallel_invoke([&] { AddMaps(image, handed, size, phi::MakeRayModel(pinhole), &map); },
                       [&] { colors = workspace_.ReadColor(image, map.width(), map.height(), handed.photo.get()); },
                       [&] { states = ReadStates(image, handed); });
  AddColors(colors, &map);
  AddStates(states, &map);
  if (!input_.mask_path.empty()) ApplyMask(image, &map);
  if (handed_ != nullptr) handed_->Forget(image);
  return map;
}

std::int64_t FusionMapReader::TransientBytes(std::int64_t num_pixels) {
  // Colours as read; the decoder holds the image a second time. Depth and normals are read by rows.
  return num_pixels * static_cast<std::int64_t>(2 * sizeof(Rgb));
}

std::int64_t FusionMapReader::ResidentBytes(std::int64_t num_pixels) {
  return num_pixels * static_cast<std::int64_t>(sizeof(phi::FusionPixel));
}

void FusionMapReader::AddMaps(int image, const HandedImage& handed, const MapSize& source, const phi::RayModel& rays,
                              phi::FusionMap* map) const {
  const auto source_row = [&](int y) { return NearestPixel(y, map->height(), source.height); };
  // pack(source_x, normal, x): the pixel's normal.
  const auto add_row = [&](int y, const auto& plane_at, const auto& pack) {
    for (int x = 0; x < map->width(); ++x) {
      const int source_x = map->width() == source.width ? x : NearestPixel(x, map->width(), source.width);
      const phi::PlaneHypothesis plane = plane_at(source_x);
      if (!(plane.depth > 0) || !std::isfinite(plane.depth)) continue;
      phi::FusionPixel& pixel = (*map)(x, y);
      pixel.depth = plane.depth;
      pixel.normal = pack(source_x, plane.normal, x);
    }
  };
  phi::ForRows(map->height(), [&](int begin, int end) {
    int y = begin;
    const auto width = static_cast<std::size_t>(source.width);
    PackedRow packed(width);
    const auto pack = [&](int source_x, phi::Vec3f normal, int x) {
      if (!IsAboutUnit(normal)) return PackChecked(normal, rays, x, y);
      return packed[static_cast<std::size_t>(source_x)];
    };
    const auto consume = [&](int source_y, const PlaneRow& row) {
      packed.Pack(row.normal);
      const auto plane_at = [&](int i) {
        return phi::PlaneHypothesis{{row.normal[0][i], row.normal[1][i], row.normal[2][i]}, row.depth[i]};
      };
      for (; y < end && source_row(y) == source_y; ++y) add_row(y, plane_at, pack);
    };
    if (handed.map != nullptr) {
      PlaneChannels row(width);
      while (y < end) {
        const int source_y = source_row(y);
        row.Load(&handed.map->planes(0, source_y), width);
        consume(source_y, {row.depth.data(), {row.x.data(), row.y.data(), row.z.data()}});
      }
      return;
    }
    ReadPlaneRows(workspace_.DepthMapPath(image, input_.kind), workspace_.NormalMapPath(image, input_.kind), consume,
                  {source_row(begin), source_row(end - 1) + 1});
  });
}

void FusionMapReader::AddColors(const ColorImage& colors, phi::FusionMap* map) {
  phi::ForRows(map->height(), [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < map->width(); ++x) {
        const Rgb& rgb = colors(x, y);
        std::uint8_t* const to = (*map)(x, y).rgb;
        for (std::size_t c = 0; c < 3; ++c) to[c] = rgb[c];  // std::copy calls the C library for each pixel
      }
    }
  });
}

phi::Mask FusionMapReader::ReadStates(int image, const HandedImage& handed) const {
  if (input_.kind != kGeometric && input_.kind != kMeasured) return {};
  if (handed.map != nullptr && !handed.map->states.empty()) return MaskOfStates(handed.map->states);
  const fs::path path = workspace_.FilledMaskPath(image, input_.kind);
  return fs::exists(path) ? ReadMask(path) : phi::Mask();
}

void FusionMapReader::AddStates(const phi::Mask& states, phi::FusionMap* map) const {
  if (states.empty()) return;
  if (input_.kind == kGeometric) {
    return ForPixels(states, map, [](std::uint8_t value, phi::FusionPixel& pixel) {
      if (value != 0) pixel.flags |= phi::FusionPixel::kInferred;
    });
  }
  ForPixels(states, map, [](std::uint8_t value, phi::FusionPixel& pixel) {
    if (value != kClueValue) return;
    pixel.depth = 0;
    pixel.normal = {};
  });
}

void FusionMapReader::ApplyMask(int image, phi::FusionMap* map) const {
  const fs::path path = MaskPath(image);
  if (!fs::exists(path)) return;
  ForPixels(ReadImageMaskFile(path), map, [](std::uint8_t value, phi::FusionPixel& pixel) {
    if (value == 0) pixel.depth = 0;
  });
}

}  // namespace colmap_ext
