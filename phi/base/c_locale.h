// Numbers in text as files and messages have them: a program that calls the library may have set a locale of decimal commas.
#pragma once

#include <clocale>
#include <cstdlib>
#include <string>

#include <locale.h>

namespace phi {

inline locale_t TheCLocale() {
  static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
  return locale;
}

// For printf's family in the calling thread, as long as it lives.
class CLocaleScope {
 public:
  CLocaleScope() : before_(uselocale(TheCLocale())) {}
  ~CLocaleScope() { uselocale(before_); }
  CLocaleScope(const CLocaleScope&) = delete;
  CLocaleScope& operator=(const CLocaleScope&) = delete;

 private:
  const locale_t before_;
};

// As std::strtod, which knows nan and inf where streams do not. `end`, if any: what follows the number.
inline double ParseDouble(const std::string& text, char** end = nullptr) {
  return strtod_l(text.c_str(), end, TheCLocale());
}

}  // namespace phi
