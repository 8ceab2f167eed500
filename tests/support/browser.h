// Pages in a real browser without a window.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/run_program.h"

namespace test_support {

// The name of a chromium on PATH; empty where there is none.
std::string FindBrowser();

using BrowserResult = std::optional<ProgramResult>;

// `options`: the window's size, and what is wanted of the page. None where the browser does not end within five minutes.
BrowserResult RunBrowser(const std::string& browser, const std::filesystem::path& page, const std::vector<std::string>& options);

}  // namespace test_support
