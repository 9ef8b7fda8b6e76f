#pragma once

#include <memory>
#include <string_view>

#include "spindle/report/renderer.hpp"

namespace spindle::report {

std::unique_ptr<Renderer> make_table_renderer(Streams& streams, Talk talk);
std::unique_ptr<Renderer> make_json_renderer(Streams& streams, Talk talk);
std::unique_ptr<Renderer> make_csv_renderer(Streams& streams, Talk talk);

/// What tables and CSV have in common: everything beside the data goes to stderr as sentences.
class PlainRenderer : public Renderer {
 public:
  PlainRenderer(Streams& streams, Talk talk) : streams_(streams), talk_(talk) {}

  Result<void> line(const Record& record, std::string_view plain) override;
  void note(std::string_view sentence) override;
  Result<void> summary(const Record& record, std::string_view sentence) override;
  Result<void> error(const Error& error, WallTime time) override;

 protected:
  [[nodiscard]] Streams& streams() { return streams_; }

 private:
  Streams& streams_;
  Talk talk_;
};

/// One line on stderr behind "spindle: ", quiet or not.
void say_error(const Streams& streams, const Error& error);

/// The sentence on stderr, unless it is empty or nobody wants it.
void say_sentence(const Streams& streams, Talk talk, std::string_view sentence);

}  // namespace spindle::report
