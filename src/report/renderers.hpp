#pragma once

#include <memory>
#include <string_view>

#include "spindle/report/renderer.hpp"

namespace spindle::report {

std::unique_ptr<Renderer> make_table_renderer(Streams& streams, Talk talk);
std::unique_ptr<Renderer> make_json_renderer(Streams& streams);
std::unique_ptr<Renderer> make_csv_renderer(Streams& streams, Talk talk);

/// One line on stderr behind "spindle: ", quiet or not.
void say_error(const Streams& streams, const Error& error);

/// The sentence on stderr, unless it is empty or nobody wants it.
void say_summary(const Streams& streams, Talk talk, std::string_view sentence);

}  // namespace spindle::report
