// Dark or light: what the system prefers, until the reader chooses. The colours are in style.css.

const system = matchMedia("(prefers-color-scheme: dark)");

export class Theme {
  constructor(onChange) {
    this.onChange = onChange;
    system.addEventListener("change", () => onChange());
  }

  get dark() {
    const chosen = document.documentElement.dataset.theme;
    return chosen === undefined ? system.matches : chosen === "dark";
  }

  toggle() {
    document.documentElement.dataset.theme = this.dark ? "light" : "dark";
    this.onChange();
  }

  /// A custom property of style.css.
  colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  }
}
