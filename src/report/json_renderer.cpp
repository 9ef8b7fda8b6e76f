#include "json_writer.hpp"
#include "renderers.hpp"

namespace spindle::report {
namespace {

class JsonRenderer final : public Renderer {
 public:
  explicit JsonRenderer(Streams& streams) : streams_(streams) {}

  Result<void> begin(std::span<const Column> /*columns*/) override { return {}; }

  Result<void> record(const Record& record) override {
    line_.clear();
    append_json(line_, record);
    line_ += '\n';
    return streams_.out(line_);
  }

  Result<void> end() override { return {}; }

  Result<void> summary(const Record& counts, std::string_view /*sentence*/) override {
    return record(counts);
  }

  Result<void> error(const Error& error, WallTime time) override {
    Result<void> written = record(error_record(error, time));
    say_error(streams_, error);
    return written;
  }

 private:
  Streams& streams_;
  std::string line_;
};

}  // namespace

std::unique_ptr<Renderer> make_json_renderer(Streams& streams) {
  return std::make_unique<JsonRenderer>(streams);
}

}  // namespace spindle::report
