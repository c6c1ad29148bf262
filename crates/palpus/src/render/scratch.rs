//! All working memory of a renderer, sized once.
