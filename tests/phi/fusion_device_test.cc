// Fusion with a device gives the host's bytes, whatever the device does.
#include "phi/fusion/fusion_device.h"

#include <gtest/gtest.h>

#include "phi/base/error.h"
#include "tests/support/scene_fusers.h"

namespace phi {
namespace {

// Decides by the scalar rule from the host's maps.
class ScalarDevice : public FusionDevice {
 public:
  int num_calls = 0, num_forgotten = 0;
  int first_failing_call = 1 << 30;
  FusionGates gates;  // of the last call

  void Load(ArrayView2D<const FusionPixel>) override {}
  void Forget(ArrayView2D<const FusionPixel>) override { ++num_forgotten; }

  std::unique_ptr<Image> Start(ArrayView2D<const FusionPixel> reference, const RayModel& rays,
                               const std::vector<FusionNeighbor>& neighbors) override {
    if (num_calls > first_failing_call) return nullptr;
    return std::make_unique<ScalarImage>(this, reference, rays, neighbors);
  }

 private:
  class ScalarImage : public Image {
   public:
    ScalarImage(ScalarDevice* device, ArrayView2D<const FusionPixel> map, const RayModel& rays, std::vector<FusionNeighbor> neighbors)
        : device_(device), map_(map), rays_(rays), neighbors_(std::move(neighbors)) {}

    DecidedPixels Decide(const FusionGates& gates, const std::vector<std::uint32_t>& pixels) override {
      device_->gates = gates;
      if (device_->num_calls++ >= device_->first_failing_call) throw ResourceError("fusion: the device has failed");
      DecidedPixels decided;
      for (const std::uint32_t number : pixels) {
        const int x = static_cast<int>(number) % map_.width, y = static_cast<int>(number) / map_.width;
        const ReferencePixel pixel = {map_(x, y), rays_.Ray(x + 0.5f, y + 0.5f), rays_.fx};
        const PixelSupport support = DecidePixel(neighbors_.data(), static_cast<int>(neighbors_.size()), gates, pixel);
        decided.outcomes.push_back(JudgePixel(gates, support, (pixel.pixel.flags & FusionPixel::kInferred) != 0));
        if (decided.outcomes.back() == PixelOutcome::kFused) {
          decided.fused.push_back({number, support.point, DoubtsOf(support), support.views});
        }
      }
      return decided;
    }

   private:
    ScalarDevice* device_;
    ArrayView2D<const FusionPixel> map_;
    RayModel rays_;
    std::vector<FusionNeighbor> neighbors_;
  };
};

class FusionDeviceTest : public testing::Test {
 protected:
  // Holes are filled, and each pass gives points.
  void ExpectTheHostsBytes(const FusionOptions& options, const BoundingBox* box) {
    const test_support::FusedScene expected = test_support::FuseAllImages(scene_, options, box, nullptr);
    test_support::ExpectSameBytes(test_support::FuseAllImages(scene_, options, box, &device_), expected);
    std::size_t num_points = 0;
    for (const FusedBlock& block : expected.blocks) num_points += block.points.size();
    EXPECT_GT(num_points, 1000u);
  }

  const test_support::RenderedScene scene_ = test_support::SphereScene();
  ScalarDevice device_;
};

TEST_F(FusionDeviceTest, GivesTheHostsBytes) {
  FusionOptions options;
  options.min_support = 0.2;
  options.max_normal_error = 3;  // leaves holes
  ExpectTheHostsBytes(options, nullptr);
  EXPECT_GT(device_.num_calls, 0);
  EXPECT_EQ(device_.num_forgotten, 0);  // its own flags are right
}

TEST_F(FusionDeviceTest, PointsOutsideTheBoxCoverNothing) {
  const BoundingBox box = {{-10, -10, -10}, {0.1, 10, 10}};
  ExpectTheHostsBytes({}, &box);
  EXPECT_EQ(device_.num_forgotten, static_cast<int>(scene_.views.size()));
}

TEST_F(FusionDeviceTest, ImprobablePointsCoverNothing) {
  ExpectTheHostsBytes({.min_confidence = 0.9}, nullptr);
  EXPECT_EQ(device_.num_forgotten, static_cast<int>(scene_.views.size()));
}

TEST_F(FusionDeviceTest, TheHostGoesOnWhereItFails) {
  device_.first_failing_call = 5;
  ExpectTheHostsBytes({}, nullptr);
  EXPECT_GT(device_.num_calls, 5);
  EXPECT_EQ(device_.num_forgotten, static_cast<int>(scene_.views.size()));
}

TEST_F(FusionDeviceTest, RulesScaleTheGates) {
  FusionOptions options;
  options.method.rules.Set(Rule::kRayAgreement, 2);
  options.method.rules.Set(Rule::kConflicts, 3);
  options.method.rules.Set(Rule::kCover, 0.5f);
  options.method.rules.Set(Rule::kCloudHoles, 0);  // the last call's gates are the first's
  ExpectTheHostsBytes(options, nullptr);
  EXPECT_FLOAT_EQ(device_.gates.min_ray_cosine, 2 * kMinRayCosine);
  EXPECT_FLOAT_EQ(device_.gates.hopeless_factor, 2 * kHopelessFactor);
  EXPECT_FLOAT_EQ(device_.gates.seen_through_factor, 3 * kSeenThroughFactor);
  EXPECT_FLOAT_EQ(device_.gates.cover_factor, 0.5f * kCoverFactor);
  EXPECT_FLOAT_EQ(device_.gates.max_coarsening, 0.5f * kMaxCoarsening);
  EXPECT_FLOAT_EQ(device_.gates.min_slant_cosine, 0.5f * kMinSlantCosine);
}

}  // namespace
}  // namespace phi
