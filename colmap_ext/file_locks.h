// Locks that the system gives up when their process dies. Only processes that share the file system's locks see them; where it has
// none, the user is trusted.
#pragma once

namespace colmap_ext {

// Takes a lock on an open file or folder; `kind`: LOCK_EX or LOCK_SH. True when another process holds it for longer than one that only
// looks, for left-overs or for who is at work.
bool IsLockRefused(int descriptor, int kind);

// Whether the open file has lost its name, and with it its lock's meaning, since it was opened.
bool IsUnlinked(int descriptor);

// Gives the lock up and closes; nothing for -1. Closing alone would leave the lock with processes that were forked meanwhile, of
// Python's multiprocessing for example.
void ReleaseLock(int descriptor);

}  // namespace colmap_ext
