//! The controls: a slider and a typed value for each idea, with its unit, its text, and the core's error beside it.
import { accepted, type Control, controls, type Design, fromSlider, range, toSlider } from "./design.js";
import { byId, make } from "./ink.js";

export class Controls {
  private readonly parts = new Map<string, { host: HTMLElement; set: (value: string) => void; error: HTMLElement }>();

  constructor(private readonly changed: (id: string, value: string) => void) {}

  /** Makes the controls, a group in a task of its own, so that the page answers meanwhile; then shows a design. */
  async build(design: () => Design): Promise<void> {
    for (const name of new Set(controls.map((one) => one.group))) {
      const own = controls.filter((one) => one.group === name);
      byId("controls").append(make("fieldset", {}, make("legend", {}, name), ...own.map((one) => this.made(one))));
      await new Promise((done) => setTimeout(done, 0));
    }
    this.show(design());
  }

  private made(one: Control): HTMLElement {
    const error = make("p", { class: "error", id: `${one.id}-error`, role: "alert" });
    const help = make("p", { class: "help", id: `${one.id}-help` }, one.help);
    if (one.scale === "choice") {
      const select = make("select", { id: one.id, "aria-describedby": `${one.id}-help ${one.id}-error` },
        ...one.choices!.map(([value, name]) => make("option", { value }, name)));
      select.addEventListener("change", () => this.changed(one.id, select.value));
      const host = make("div", { class: "control" }, make("label", { for: one.id }, one.label), select, help, error);
      this.parts.set(one.id, { host, error, set: (value) => { select.value = value; } });
      return host;
    }
    const unit = one.unit ? `, ${one.unit}` : "", described = `${one.id}-help ${one.id}-error`;
    const slider = make("input", { type: "range", id: one.id, min: "0", max: "1000", step: "1", "aria-describedby": described,
      "aria-label": `${one.label}${unit}` });
    const typed = make("input", { type: "text", inputmode: "decimal", id: `${one.id}-value`, size: "7", "aria-describedby": described,
      "aria-label": `${one.label} as a number${unit}` });
    slider.addEventListener("input", () => {
      const value = fromSlider(one, Number(slider.value));
      typed.value = value;
      slider.setAttribute("aria-valuetext", `${value} ${one.unit}`);
      this.changed(one.id, value);
    });
    // Arrow keys go by steps of the value where these are coarser than those of the slider.
    slider.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (way === undefined || !one.step || one.scale === "log") return;
      event.preventDefault();
      const next = Math.min(one.max!, Math.max(one.min!, Number(typed.value) + way * one.step));
      this.set(one.id, String(next));
      this.changed(one.id, typed.value);
    });
    const enter = (): void => {
      const value = accepted(one, typed.value);
      if (value === undefined) {
        error.textContent = range(one);
        typed.setAttribute("aria-invalid", "true");
        return;
      }
      this.set(one.id, value);
      this.clear(one.id);
      this.changed(one.id, value);
    };
    typed.addEventListener("change", enter);
    const set = (value: string): void => {
      slider.value = String(toSlider(one, value));
      slider.setAttribute("aria-valuetext", `${value} ${one.unit}`);
      typed.value = value;
    };
    const value = make("span", { class: "value" }, typed, make("span", { class: "unit" }, one.unit));
    const host = make("div", { class: "control" }, make("span", { class: "label" }, one.label), value, slider, help, error);
    this.parts.set(one.id, { host, error, set });
    return host;
  }

  private set(id: string, value: string): void {
    this.parts.get(id)!.set(value);
  }

  /** Shows a design; what was typed wrong stays. */
  show(design: Design): void {
    for (const one of controls) {
      const part = this.parts.get(one.id);
      if (!part) continue;
      if (!part.host.querySelector("[aria-invalid]")) part.set(design[one.id]!);
      part.host.hidden = one.when ? !one.when(design) : false;
    }
  }

  /** Takes the message of one control away, or all of the core's: what was typed wrong stays until it is typed anew. */
  clear(id?: string): void {
    for (const [name, { error, host }] of this.parts) {
      if (id === undefined ? host.querySelector("[aria-invalid]") : name !== id) continue;
      error.textContent = "";
      host.querySelector("[aria-invalid]")?.removeAttribute("aria-invalid");
    }
  }

  /** Puts a message beside its control; false where there is no such control. */
  complain(id: string | undefined, message: string): boolean {
    const part = id === undefined ? undefined : this.parts.get(id);
    if (!part) return false;
    part.host.hidden = false;
    part.error.textContent = message;
    return true;
  }
}
