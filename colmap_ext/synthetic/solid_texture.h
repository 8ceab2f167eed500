// Band-limited solid textures: colour as a function of a point in an object's own frame.
//
// Value noise is summed over octaves from a coarsest to a finest lattice spacing. Nothing finer than the
// finest lattice is there, so a renderer whose pixels are not much larger needs only moderate supersampling.
#pragma once

#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace colmap_ext {

// Linear RGB in grey levels, [0, 255].
using Radiance = Eigen::Vector3f;

// Value noise in [0, 1] on the unit lattice, continuously differentiable.
double ValueNoise(std::uint32_t seed, const Eigen::Vector3d& point);

struct SolidTexture {
  Radiance dark = {60, 60, 60}, light = {200, 200, 200};
  double coarsest_spacing = 0.4;  // of the noise lattice, world units
  double finest_spacing = 0.0125;
  double persistence = 1;  // amplitude of an octave relative to the next coarser one
  Eigen::Vector3d stretch{
      1, 1, 1};  // spacing along each axis of the object's frame is multiplied by this (wood grain)
  // Size of the tiles (planks, bricks) that the object is laid with, in its frame; infinite along an axis =
  // none. Each tile has a pattern of its own and a tone that differs by up to tile_contrast of the range from
  // dark to light.
  Eigen::Vector3d tile_size = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  double tile_contrast = 0;
  std::uint32_t seed = 0;

  // Colour of the unlit surface at `point` in the object's frame.
  Radiance At(const Eigen::Vector3d& point) const;
};

// A painted surface: one colour with faint, broad mottling of at most `contrast` grey levels from darkest to
// lightest.
struct Paint {
  Radiance color = {200, 200, 200};
  double contrast = 0.9;  // grey levels
  double spacing = 0.3;   // of the mottling's lattice, world units
  std::uint32_t seed = 0;

  Radiance At(const Eigen::Vector3d& point) const;
};

}  // namespace colmap_ext
