#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "page/board.hpp"
#include "page/words.hpp"
#include "spindle/base/clock.hpp"

/// The page as HTML. Every text from outside is escaped here. Pure.
namespace spindle::page {

/// The name of a station's element: letters and digits, the same for the same name.
std::string key_of(const std::string& name);

struct Moment {
  WallTime now = {};
  const Clock& clock;  ///< of the zone
};

/// One tool.
std::string card_html(const Station& station, const LinkView& link, const Moment& moment);

/// What holds for all of them.
struct Overview {
  std::size_t tools = 0;
  std::size_t up = 0;
  std::size_t down = 0;
  std::size_t unknown = 0;
  std::uint64_t ok = 0;
  std::uint64_t ng = 0;
  MissedSum missed = {};
  Shift shift = {};
  Recorder recorder = Recorder::unknown;
  std::string problem = {};           ///< why the store cannot be read; empty: it can
  std::vector<std::string> old = {};  ///< names of tools that are left out
};
std::string overview_html(const Overview& overview, const Moment& moment);

/// The whole page.
struct PageParts {
  std::string id = {};  ///< position up to which it tells
  std::string overview = {};
  std::vector<std::string> cards = {};
  std::string as_of = {};
  std::string zone = {};
  std::string version = {};
};
std::string page_html(const PageParts& parts);

/// A page with a sentence, for those who may not see the other.
std::string sentence_html(std::string_view title, std::string_view sentence);

std::string_view style_css();
std::string_view script_js();
std::string_view icon_svg();

}  // namespace spindle::page
