// Elements, made and found.

export const $ = (id) => document.getElementById(id);

/** An element with attributes; children are nodes or text. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === 'tag') element.style.setProperty('--tag', value);
    else if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (value !== false && value !== undefined) element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.filter((child) => child !== undefined && child !== ''));
  return element;
}

/** Buttons of which one is pressed. `options`: [value, words] each. Gives a function that presses one. */
export function choices(bar, name, options, pressed, onChange) {
  const buttons = new Map();
  const press = (value) => {
    for (const [v, button] of buttons) button.setAttribute('aria-pressed', String(v === value));
  };
  for (const [value, words] of options) {
    const choose = () => {
      press(value);
      onChange(value);
    };
    buttons.set(value, make('button', {type: 'button', 'data-choice': value, onclick: choose}, words));
  }
  bar.append(make('div', {class: 'group', role: 'group', 'aria-label': name}, ...buttons.values()));
  press(pressed);
  return press;
}

/** Buttons that are on or off by themselves. `options`: [key, words] each; `state` holds the keys. */
export function switches(bar, name, options, state, onChange) {
  const button = ([key, words]) => {
    const element = make('button', {type: 'button', 'data-switch': key, 'aria-pressed': String(state[key])}, words);
    element.addEventListener('click', () => {
      state[key] = !state[key];
      element.setAttribute('aria-pressed', String(state[key]));
      onChange();
    });
    return element;
  };
  if (options.length > 0) bar.append(make('div', {class: 'group', role: 'group', 'aria-label': name}, ...options.map(button)));
}

export function slider(bar, words, {min, max, step, value}, onChange) {
  const input = make('input', {type: 'range', min, max, step, value, 'aria-label': words});
  input.addEventListener('input', () => onChange(Number(input.value)));
  bar.append(make('label', {class: 'slider'}, words, input));
}
