// Elements as expressions. Text always enters as text, never as markup.
type Child = Node | string | number | null | undefined | false;
type Listener = (event: never) => void;
type Attributes = Record<string, string | number | boolean | undefined | Listener>;

/// `on…` keys add listeners, booleans set or leave out an attribute, everything else is an attribute.
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value as EventListener);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== undefined) element.setAttribute(name, String(value));
  }
  fill(element, ...children);
  return element;
}

/// The same for drawings, whose elements have names of their own.
export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K, attributes: Record<string, string | number> = {}, ...children: Node[]): SVGElementTagNameMap[K] {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/// Replaces the content.
export function fill(element: Element, ...children: Child[]): void {
  element.replaceChildren(...children.filter((c): c is Node | string | number => c !== null && c !== undefined && c !== false)
    .map((c) => (typeof c === "number" ? String(c) : c)));
}

/// Changes text only when it differs, so that selections and layout stay put.
export function set_text(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function show_if(element: HTMLElement, visible: boolean): void {
  element.hidden = !visible;
}

/// A label above (or beside) its field; `unit` stands behind the number.
export function field(label: string, input: HTMLElement, unit = ""): HTMLElement {
  return h("label", { class: "field" }, h("span", { class: "field-label" }, label),
    h("span", { class: "field-input" }, input, unit ? h("span", { class: "unit" }, unit) : null));
}

export function number_input(test_id: string, label: string, value: number, limits: { min?: number; max?: number; step?: number }) {
  return h("input", { type: "number", value, ...limits, "data-testid": test_id, "aria-label": label, inputmode: "decimal" });
}

/// Fills a <select> without losing the choice; does nothing when the options are the same.
export function set_options(select: HTMLSelectElement, options: { value: string; text: string }[], chosen: string): void {
  const signature = JSON.stringify(options);
  if (select.dataset.options !== signature) {
    select.dataset.options = signature;
    select.replaceChildren(...options.map((o) => h("option", { value: o.value }, o.text)));
  }
  if (select.value !== chosen) select.value = chosen;
}

/// The number in a field, or an Error that names it.
export function read_number(input: HTMLInputElement): number {
  const value = input.valueAsNumber;
  const name = input.getAttribute("aria-label") ?? "number";
  if (!Number.isFinite(value)) throw new Error(`${name}: a number is needed`);
  if (!input.checkValidity()) throw new Error(`${name}: ${input.validationMessage}`);
  return value;
}
