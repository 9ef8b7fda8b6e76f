#include "display.hpp"
#include "renderers.hpp"

namespace spindle::report {
namespace {

/// The values alone, for scripts: those of one record are a line, and tabs stand between them.
class ValueRenderer final : public PlainRenderer {
 public:
  ValueRenderer(Streams& streams, const Look& look)
      : PlainRenderer(streams, look.verbosity), look_(look) {}

  Result<void> begin(std::span<const Column> columns) override {
    TRY_LET(auto chosen, chosen_columns(columns, look_));
    columns_ = std::move(chosen);
    return {};
  }

  Result<void> record(const Record& record) override {
    std::string made;
    line_.clear();
    for (const Column& column : columns_) {
      if (&column != &columns_.front()) line_ += '\t';
      line_ += printable(cell_text(record, column.key, made), LineBreaks::fold);
    }
    line_ += '\n';
    return lines_.write(line_);
  }

  Result<void> end() override { return {}; }

 private:
  Look look_;
  std::vector<Column> columns_;
  std::string line_;
  LineWriter lines_{streams(), "\n"};
};

}  // namespace

std::unique_ptr<Renderer> make_value_renderer(Streams& streams, const Look& look) {
  return std::make_unique<ValueRenderer>(streams, look);
}

}  // namespace spindle::report
