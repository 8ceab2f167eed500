#include "phi/base/random.h"

#include <gtest/gtest.h>

namespace phi {
namespace {

// Known answers of Philox4x32-10 published with the algorithm (Random123's kat_vectors).
TEST(Philox, MatchesKnownAnswers) {
  const Random4 zeros = Philox({0, 0}, 0, 0, 0);
  EXPECT_EQ(zeros.v[0], 0x6627e8d5u);
  EXPECT_EQ(zeros.v[1], 0xe169c58du);
  EXPECT_EQ(zeros.v[2], 0xbc57ac4cu);
  EXPECT_EQ(zeros.v[3], 0x9b00dbd8u);
  const Random4 ones = Philox({~0u, ~0u}, ~0ull, ~0u, ~0u);
  EXPECT_EQ(ones.v[0], 0x408f276du);
  EXPECT_EQ(ones.v[1], 0x41c83b0eu);
  EXPECT_EQ(ones.v[2], 0xa20bc7c6u);
  EXPECT_EQ(ones.v[3], 0x6d5451fdu);
}

TEST(Philox, UniformFloatCoversHalfOpenUnitInterval) {
  EXPECT_EQ(UniformFloat(0), 0.0f);
  EXPECT_LT(UniformFloat(~0u), 1.0f);
  EXPECT_EQ(SymmetricFloat(0), -1.0f);
}

}  // namespace
}  // namespace phi
