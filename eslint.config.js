// What eslint checks of the explorer's page and of its tests; what others wrote is not checked.

import js from "@eslint/js";

const BROWSER = [
  "AbortController", "DOMException", "IntersectionObserver", "ImageData", "OffscreenCanvas", "ResizeObserver", "URL", "addEventListener",
  "cancelAnimationFrame", "clearTimeout", "document", "fetch", "getComputedStyle", "history", "location", "matchMedia",
  "navigator", "performance", "requestAnimationFrame", "setTimeout", "structuredClone", "window",
];

export default [
  { ignores: ["gaitgraph/explorer/page/vendor/", "**/.venv/", "build/", "dist/", "docs/_build/", "docs/_static/", "site/"] },
  js.configs.recommended,
  {
    languageOptions: { globals: Object.fromEntries(BROWSER.map((name) => [name, "readonly"])) },
    rules: {
      complexity: ["error", 15],
      eqeqeq: "error",
      "no-nested-ternary": "error",
      "no-shadow": "error",
      "no-unused-vars": ["error", { varsIgnorePattern: "^_" }],
      "no-use-before-define": ["error", { functions: false, variables: false }],
      "no-var": "error",
      "prefer-const": "error",
    },
  },
];
