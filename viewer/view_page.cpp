#include "viewer/view.hpp"

// The parts of the page, defined by page_parts.S.
extern "C" {
extern const char vnreg_page_html[], vnreg_page_html_end[];
extern const char vnreg_page_style[], vnreg_page_style_end[];
extern const char vnreg_page_three[], vnreg_page_three_end[];
extern const char vnreg_page_script[], vnreg_page_script_end[];
}

namespace vnreg::viewer {
namespace {

/// Appends `text` with the placeholder `mark`, which it has once, replaced by `content`.
std::string with_part(std::string_view text, std::string_view mark, std::string_view content) {
  const std::size_t at = text.find(mark);
  std::string result;
  result.reserve(text.size() + content.size());
  result.append(text.substr(0, at)).append(content).append(text.substr(at + mark.size()));
  return result;
}

}  // namespace

std::string view_template() {
  std::string page(vnreg_page_html, vnreg_page_html_end);
  page = with_part(page, "{{vnreg:style}}", {vnreg_page_style, vnreg_page_style_end});
  page = with_part(page, "{{vnreg:script}}", {vnreg_page_script, vnreg_page_script_end});
  return with_part(page, "{{vnreg:three}}", {vnreg_page_three, vnreg_page_three_end});
}

std::string view_page(std::string_view data) {
  return with_part(view_template(), data_placeholder, data);
}

}  // namespace vnreg::viewer
