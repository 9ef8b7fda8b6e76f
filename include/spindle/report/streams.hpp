#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"

namespace spindle::report {

enum class Color : std::uint8_t { off, on };

/// The three standard streams, as functions so that tests can catch them.
struct Streams {
  /// Writes and flushes; `closed_pipe` when there is no reader any more.
  std::function<Result<void>(std::string_view)> out;
  /// Never fails: there is no other way to tell.
  std::function<void(std::string_view)> err;
  /// One line from the user without its end; empty at end of input.
  std::function<std::optional<std::string>()> read_line;
  bool in_is_terminal = false;
  bool out_is_terminal = false;
  bool err_is_terminal = false;
  /// Whether a reader still takes what out() writes; may be empty, which means yes.
  std::function<bool()> out_is_open = {};
  /// Whether err() can write a line without waiting; may be empty, which means yes. A motor must
  /// not run on because no reader takes what is told meanwhile.
  std::function<bool()> err_is_ready = {};
  /// Cells of a row of the terminal behind err(); 0, or an empty function: not known.
  std::function<std::size_t()> err_columns = {};
  /// Rows of the same terminal; 0, or an empty function: not known.
  std::function<std::size_t()> err_rows = {};
  /// Cells of a row of the terminal behind out(); 0, or an empty function: not known.
  std::function<std::size_t()> out_columns = {};
  /// Whether out() writes to a file that ends within a line; may be empty, which means no.
  std::function<bool()> out_ends_within_line = {};
  /// Writes what is taken of the text within this time, and returns how many bytes; fails as out()
  /// does. For who must not be held up by a reader; may be empty, where out() never waits long.
  std::function<Result<std::size_t>(std::string_view, Duration)> out_for = {};
  /// Whether the system's journal reads err(), which wants to know how important a line is.
  bool err_is_journal = false;
  Color color = Color::off;
  /// What the user typed behind the program's name: an error may say how to mend it.
  std::vector<std::string> typed = {};
};

}  // namespace spindle::report
