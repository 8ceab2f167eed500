#include "colmap_ext/cli/command.h"

int main(int argc, char** argv) { return colmap_ext::RunMain(argc, argv); }
