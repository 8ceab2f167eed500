#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "colmap_ext/atomic_file.h"
#include "colmap_ext/fusion/cloud_files.h"
#include "colmap_ext/fusion/cloud_writer.h"
#include "colmap_ext/fusion/tile_list.h"
#include "colmap_ext/json_file.h"
#include "phi/base/error.h"

namespace colmap_ext {
namespace {

constexpr double kMaxPlace = 9007199254740992.0;  // 2^53: doubles beyond do not tell a tile from the next

struct TileIndex {
  std::int64_t column = 0, row = 0;
  auto operator<=>(const TileIndex&) const = default;
};

struct Tile {
  std::filesystem::path path;
  std::unique_ptr<CloudWriter> writer;
  bool has_new = false;          // points since its last Flush()
  std::uint64_t num_points = 0;  // so far; none: all that fell on it were left out
  double least[3], most[3];
};

class TiledCloudWriter : public CloudWriter {
 public:
  TiledCloudWriter(const TileOptions& options,
                   std::function<std::unique_ptr<CloudWriter>(const std::filesystem::path&)> make_writer)
      : options_(options), make_writer_(std::move(make_writer)) {}

  void Write(phi::FusedBlock block) override {
    std::size_t first_view = 0;
    for (std::size_t i = 0; i < block.points.size(); ++i) {
      AddTo(&TileOf(block.points[i]), block.points[i], block.view_counts[i], block.views.data() + first_view);
      first_view += block.view_counts[i];
    }
    for (auto& [index, tile] : tiles_) {
      if (std::exchange(tile.has_new, false)) tile.writer->Flush();
    }
  }

  std::uint64_t num_left_out() const override { return num_left_out_; }
  std::size_t num_files() const override {
    return tiles_.size() - static_cast<std::size_t>(std::count_if(tiles_.begin(), tiles_.end(), IsEmpty));
  }

  void Commit() override {
    std::erase_if(tiles_, IsEmpty);
    for (auto& [index, tile] : tiles_) tile.writer->Complete();  // a disk that is full now leaves none of them
    RemoveUnlistedTiles(options_.path);
    const std::vector<std::filesystem::path> earlier = ListedTiles(options_.path);
    const std::string list = List();
    WriteFileAtomically(NextTileListPath(options_.path), list);
    for (auto& [index, tile] : tiles_) tile.writer->Commit();
    RemoveOthers(earlier);  // before their list is replaced: who is stopped in between finds them the next time
    WriteFileAtomically(TileListPath(options_.path), list);
    std::filesystem::remove(NextTileListPath(options_.path));
  }

 private:
  std::string List() const {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const auto& [index, tile] : tiles_) {
      list.push_back({{"file", tile.path.filename().string()},
                      {"column", index.column},
                      {"row", index.row},
                      {"points", tile.num_points},
                      {"min", tile.least},
                      {"max", tile.most}});
    }
    const nlohmann::ordered_json content = {
        {"tile_size", options_.size}, {"origin", options_.origin}, {"tiles", std::move(list)}};
    return DumpJson(content, 1) + "\n";
  }

  // Tiles of another size beside these would be taken for parts of one cloud.
  void RemoveOthers(const std::vector<std::filesystem::path>& earlier) const {
    std::set<std::filesystem::path> own;
    for (const auto& [index, tile] : tiles_) own.insert(tile.path);
    for (const std::filesystem::path& tile : earlier) {
      if (!own.contains(tile)) RemoveEarlierPart(tile);
    }
  }

  Tile& TileOf(const phi::FusedPoint& point) {
    const auto place = [&](std::size_t axis) {
      const double index = std::floor((point.xyz[axis] - options_.origin[axis]) / options_.size);
      if (!(std::abs(index) < kMaxPlace)) RefuseSize();
      return static_cast<std::int64_t>(index);
    };
    const TileIndex index{place(0), place(1)};
    const auto found = tiles_.find(index);
    if (found != tiles_.end()) return found->second;
    Tile& tile = tiles_[index];
    tile.path = TilePath(options_.path, index.column, index.row);
    tile.writer = make_writer_(tile.path);
    std::fill(tile.least, tile.least + 3, std::numeric_limits<double>::max());
    std::fill(tile.most, tile.most + 3, std::numeric_limits<double>::lowest());
    return tile;
  }

  [[noreturn]] void RefuseSize() const {
    throw phi::InputError("--tile_size " + DumpJson(nlohmann::ordered_json(options_.size), -1) +
                          " is finer than the points' coordinates; ask for larger tiles");
  }

  static bool IsEmpty(const std::pair<const TileIndex, Tile>& tile) { return tile.second.num_points == 0; }

  void AddTo(Tile* tile, const phi::FusedPoint& point, std::uint32_t num_views, const std::uint32_t* views) {
    if (!tile->writer->Add(point, num_views, views)) {
      ++num_left_out_;
      return;
    }
    tile->has_new = true;
    ++tile->num_points;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      tile->least[axis] = std::min(tile->least[axis], point.xyz[axis]);
      tile->most[axis] = std::max(tile->most[axis], point.xyz[axis]);
    }
  }

  const TileOptions options_;
  const std::function<std::unique_ptr<CloudWriter>(const std::filesystem::path&)> make_writer_;
  std::map<TileIndex, Tile> tiles_;
  std::uint64_t num_left_out_ = 0;
};

}  // namespace

std::shared_ptr<WriteQueues> MakeQueuesOfTiles(std::size_t max_open_files) {
  auto queues = std::make_shared<WriteQueues>();
  queues->point_files = std::make_shared<OpenFiles>(max_open_files);
  queues->view_files = std::make_shared<OpenFiles>(max_open_files);
  return queues;
}

std::unique_ptr<CloudWriter> MakeTiledCloudWriter(
    const TileOptions& options,
    std::function<std::unique_ptr<CloudWriter>(const std::filesystem::path&)> make_writer) {
  return std::make_unique<TiledCloudWriter>(options, std::move(make_writer));
}

}  // namespace colmap_ext
