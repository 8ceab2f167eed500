#include "tests/support/browser.h"

namespace test_support {

std::string FindBrowser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    if (HasProgram(name)) return name;
  }
  return "";
}

BrowserResult RunBrowser(const std::string& browser, const std::filesystem::path& page, const std::vector<std::string>& options) {
  constexpr int kTimedOut = 124, kKilled = 137;  // exit codes of `timeout`
  // A page takes 3 to 7 s of processor time. Now and then the browser sleeps for minutes, and one that is started anew does not;
  // on a machine that is busy with other work a page may take a hundred seconds.
  for (const char* seconds : {"30", "90", "180"}) {
    const std::filesystem::path profile = page.parent_path() / "profile";
    std::filesystem::remove_all(profile);
    std::vector<std::string> command{"timeout", "--kill-after=5", seconds, browser, "--headless", "--no-sandbox",
                                     "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                                     "--disable-extensions", "--disable-background-networking", "--disable-component-update",
                                     "--hide-scrollbars", "--user-data-dir=" + profile.string()};
    command.insert(command.end(), options.begin(), options.end());
    command.push_back("file://" + page.string());
    ProgramResult result = RunProgram(command);
    if (result.exit_code != kTimedOut && result.exit_code != kKilled) return result;
  }
  return std::nullopt;
}

}  // namespace test_support
