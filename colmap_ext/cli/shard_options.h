// --shard and its kin: which part of the images this process does, said on the command line or by a cluster's job array.
#pragma once

#include <string>

#include "colmap_ext/pipeline/shard.h"
#include "phi/base/option.h"

namespace colmap_ext {

struct ShardOptions {
  std::string shard;   // "K/N", K from 0; empty: from the job array's variables, else all
  int num_shards = 0;  // 0: as `shard` or the job array says
  std::string stage;   // empty: all

  // All but the stage.
  phi::OptionList List();
  // Logs what a job array's variable has decided. Throws phi::UsageError.
  Shard Resolve() const;
};

}  // namespace colmap_ext
