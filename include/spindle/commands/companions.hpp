#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "spindle/base/clock.hpp"
#include "spindle/base/error.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/base/line_channel.hpp"

namespace spindle::commands {

class Outcome;
struct Context;
struct ForwardOptions;
struct ServeOptions;

/// What programs of their own do, because they alone need the libraries for it: spindle itself
/// starts fast, and what holds the tools never talks to the plant's network. In spindle each of
/// these goes on as the other program, with the same arguments; in that program it does the work.
struct Companions {
  std::function<Result<Outcome>(const ForwardOptions&, Context&)> forward = {};
  std::function<Result<Outcome>(const ServeOptions&, Context&)> page = {};
  /// Starts the program of `forward` beside this one, with these arguments; may be empty.
  std::function<Result<std::unique_ptr<LineChannel>>(const std::vector<std::string>& arguments,
                                                     Clock& clock, const Interrupt& interrupt)>
      start_forward = {};
};

}  // namespace spindle::commands
