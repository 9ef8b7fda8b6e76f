#include "files/document_form.hpp"

#include <fmt/format.h>

#include "files/yaml_map.hpp"

namespace spindle::files {

bool has_form(const YamlNode& document, std::string_view what, Diagnostics& findings) {
  if (!expect(document, YamlNode::Kind::map, findings)) return false;
  const YamlNode* named = document.find("kind");
  if (named == nullptr || named->text != fmt::format("spindle-{}", what)) {
    findings.add(named == nullptr ? document.at : named->at,
                 fmt::format("this is no {0}: it does not say 'kind: spindle-{0}', as those of "
                             "'spindle {0}' do",
                             what));
    return false;
  }
  const YamlNode* format = document.find("format");
  if (format != nullptr && format->text == known_format) return true;
  findings.add(format == nullptr ? document.at : format->at,
               fmt::format("this version reads {}s of format {}", what, known_format));
  return false;
}

}  // namespace spindle::files
