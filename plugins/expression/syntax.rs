//! Parser of formulas to a syntax tree: numbers, names, calls, operators, vectors in brackets.
use crate::mistake::{Input, Mistake};
use std::ops::Range;
use winnow::ascii::multispace0;
use winnow::combinator::{Infix, Prefix, expression, fail, opt, peek};
use winnow::error::{ErrMode, ParserError};
use winnow::stream::{Location, Stream};
use winnow::token::{any, take_while};
use winnow::{ModalResult, Parser};

/// Maximum length of a formula, in bytes. The parser is recursive, so its depth has to be limited.
const MAX_FORMULA_BYTES: usize = 2000;
/// Maximum nesting depth of parentheses and brackets.
const MAX_NESTING: usize = 64;

/// A formula or a part of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Formula {
    pub span: Range<usize>,
    pub node: Node,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Node {
    Number(f64),
    /// A variable or a constant.
    Name(String),
    /// A function or an operator; `[a, b]` is a call of `vector`.
    Call {
        name: String,
        at: Range<usize>,
        arguments: Vec<Formula>,
    },
}

type Parsed<T> = ModalResult<T, Mistake>;

/// Reads a formula.
pub(crate) fn parse(text: &str) -> Result<Formula, Mistake> {
    if text.trim().is_empty() {
        return Err(
            Mistake::new(0..text.len(), "the formula is empty").help("expected one such as `norm(v) - 1`")
        );
    }
    if text.len() > MAX_FORMULA_BYTES {
        let message =
            format!("{} bytes are more than the {MAX_FORMULA_BYTES} that a formula may have", text.len());
        return Err(Mistake::new(MAX_FORMULA_BYTES..MAX_FORMULA_BYTES, message)
            .help("split it over several rows or factors"));
    }
    if let Some(at) = too_deep(text) {
        return Err(Mistake::new(at..at + 1, format!("nested more than {MAX_NESTING} levels deep")));
    }
    let mut input = Input::new(text);
    let formula = formula(&mut input).map_err(inner)?;
    match input.peek_token() {
        None => Ok(formula),
        Some(c) => Err(left_over(input.current_token_start(), c)),
    }
}

fn inner(error: ErrMode<Mistake>) -> Mistake {
    match error {
        ErrMode::Cut(mistake) | ErrMode::Backtrack(mistake) => mistake,
        ErrMode::Incomplete(_) => Mistake::new(0..0, "the formula is not complete"),
    }
}

/// Returns the error for an unexpected character in place of an operator or the end.
fn left_over(at: usize, c: char) -> Mistake {
    let span = at..at + c.len_utf8();
    match c {
        ')' | ']' => {
            Mistake::new(span, format!("this `{c}` closes nothing")).help("take it out, or open it before")
        }
        ',' => Mistake::new(span, "a comma outside of a call").help("a vector is written `[a, b, c]`"),
        '.' => Mistake::new(span, "unexpected `.`").help("write `x(v)` for the x of a vector v"),
        _ => Mistake::new(span, format!("expected an operator or the end of the formula, found `{c}`"))
            .help("operators are + - * / ^"),
    }
}

/// Returns the position at which the nesting is too deep, if there is one.
fn too_deep(text: &str) -> Option<usize> {
    let mut depth = 0usize;
    text.bytes().position(|b| {
        match b {
            b'(' | b'[' => depth += 1,
            b')' | b']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth > MAX_NESTING
    })
}

fn call(name: &str, at: Range<usize>, arguments: Vec<Formula>) -> Formula {
    let starts = arguments.iter().map(|a| a.span.start).chain([at.start]).min();
    let ends = arguments.iter().map(|a| a.span.end).chain([at.end]).max();
    let span = starts.unwrap_or(at.start)..ends.unwrap_or(at.end);
    Formula { span, node: Node::Call { name: name.to_owned(), at, arguments } }
}

fn formula(input: &mut Input<'_>) -> Parsed<Formula> {
    let formula = expression(operand).prefix(prefix).infix(infix).parse_next(input)?;
    multispace0.parse_next(input)?;
    Ok(formula)
}

fn prefix<'i>(input: &mut Input<'i>) -> Parsed<Prefix<Input<'i>, Formula, ErrMode<Mistake>>> {
    multispace0.parse_next(input)?;
    '-'.parse_next(input)?;
    // Binds weaker than ^: -x^2 is -(x^2).
    Ok(Prefix(5, |_, a| Ok(call("-", a.span.clone(), vec![a]))))
}

fn infix<'i>(input: &mut Input<'i>) -> Parsed<Infix<Input<'i>, Formula, ErrMode<Mistake>>> {
    multispace0.parse_next(input)?;
    match any.parse_next(input)? {
        '+' => Ok(Infix::Left(1, |_, a, b| Ok(binary("+", a, b)))),
        '-' => Ok(Infix::Left(1, |_, a, b| Ok(binary("-", a, b)))),
        '*' => Ok(Infix::Left(3, |_, a, b| Ok(binary("*", a, b)))),
        '/' => Ok(Infix::Left(3, |_, a, b| Ok(binary("/", a, b)))),
        '^' => Ok(Infix::Right(7, |_, a, b| Ok(binary("^", a, b)))),
        _ => fail.parse_next(input),
    }
}

fn binary(name: &str, a: Formula, b: Formula) -> Formula {
    let span = a.span.start..b.span.end;
    call(name, span, vec![a, b])
}

fn operand(input: &mut Input<'_>) -> Parsed<Formula> {
    multispace0.parse_next(input)?;
    let start = input.current_token_start();
    match peek(any).parse_next(input)? {
        '(' => {
            any.parse_next(input)?;
            let inner = formula(input)?;
            close(input, start, ')')?;
            Ok(Formula { span: start..input.previous_token_end(), ..inner })
        }
        '[' => {
            let arguments = arguments(input, ']')?;
            let span = start..input.previous_token_end();
            Ok(Formula {
                span: span.clone(),
                node: Node::Call { name: "vector".into(), at: span, arguments },
            })
        }
        c if c.is_ascii_digit() || c == '.' => number(input),
        c if c.is_alphabetic() || c == '_' => named(input),
        _ => Err(ErrMode::from_input(input)),
    }
}

/// Parses a name or a call.
fn named(input: &mut Input<'_>) -> Parsed<Formula> {
    let (name, at) =
        take_while(1.., |c: char| c.is_alphanumeric() || c == '_').with_span().parse_next(input)?;
    let before = input.checkpoint();
    multispace0.parse_next(input)?;
    if opt(peek('(')).parse_next(input)?.is_none() {
        input.reset(&before);
        return Ok(Formula { span: at, node: Node::Name(name.to_owned()) });
    }
    let arguments = arguments(input, ')')?;
    let span = at.start..input.previous_token_end();
    Ok(Formula { span, node: Node::Call { name: name.to_owned(), at, arguments } })
}

/// Parses the arguments between parentheses or brackets, including the opening one.
fn arguments(input: &mut Input<'_>, closing: char) -> Parsed<Vec<Formula>> {
    let start = input.current_token_start();
    any.parse_next(input)?;
    multispace0.parse_next(input)?;
    let mut arguments = Vec::new();
    if opt(closing).parse_next(input)?.is_some() {
        return Ok(arguments);
    }
    loop {
        if input.peek_token().is_none() {
            close(input, start, closing)?;
        }
        arguments.push(formula(input)?);
        if opt(',').parse_next(input)?.is_none() {
            close(input, start, closing)?;
            return Ok(arguments);
        }
        multispace0.parse_next(input)?;
    }
}

/// Parses the closing parenthesis or bracket of the opening one at `start`.
fn close(input: &mut Input<'_>, start: usize, closing: char) -> Parsed<()> {
    if opt(closing).parse_next(input)?.is_some() {
        return Ok(());
    }
    let opening = if closing == ')' { '(' } else { '[' };
    Err(ErrMode::Cut(match input.peek_token() {
        None => Mistake::new(start..start + 1, format!("this `{opening}` is never closed"))
            .help(format!("a `{closing}` is missing")),
        Some(c) => {
            let at = input.current_token_start();
            let message = format!("expected `,`, an operator or `{closing}`, found `{c}`");
            Mistake::new(at..at + c.len_utf8(), message)
                .help(format!("a `{opening}` before it is still open"))
        }
    }))
}

fn number(input: &mut Input<'_>) -> Parsed<Formula> {
    let digits = || take_while(0.., |c: char| c.is_ascii_digit());
    let exponent = (
        winnow::token::one_of(['e', 'E']),
        opt(winnow::token::one_of(['+', '-'])),
        take_while(1.., |c: char| c.is_ascii_digit()),
    );
    let (text, span) =
        (digits(), opt(('.', digits())), opt(exponent)).take().with_span().parse_next(input)?;
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(Formula { span, node: Node::Number(number) }),
        _ => Err(ErrMode::Cut(Mistake::new(span, format!("`{text}` is not a finite number")))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The syntax tree in prefix form.
    fn tree(text: &str) -> String {
        fn show(formula: &Formula) -> String {
            match &formula.node {
                Node::Number(x) => x.to_string(),
                Node::Name(name) => name.clone(),
                Node::Call { name, arguments, .. } => {
                    let arguments: Vec<_> = arguments.iter().map(show).collect();
                    format!("({name} {})", arguments.join(" "))
                }
            }
        }
        parse(text).map_or_else(|mistake| mistake.message, |formula| show(&formula))
    }

    #[test]
    fn operators_bind_as_in_mathematics() {
        assert_eq!(tree("1 - 2 - 3"), "(- (- 1 2) 3)");
        assert_eq!(tree("a + b * c ^ 2 ^ d"), "(+ a (* b (^ c (^ 2 d))))");
        assert_eq!(tree("-a ^ 2"), "(- (^ a 2))");
        assert_eq!(tree("-a * b"), "(* (- a) b)");
        assert_eq!(tree("2 * -a"), "(* 2 (- a))");
        assert_eq!(tree("( a+b ) /c"), "(/ (+ a b) c)");
        assert_eq!(tree("a - -1.5e-3"), "(- a (- 0.0015))");
    }

    #[test]
    fn calls_and_vectors_nest() {
        assert_eq!(tree("1 - abs(dot(major_axis(q), up))"), "(- 1 (abs (dot (major_axis q) up)))");
        assert_eq!(tree("[1, .5, x ( v )]"), "(vector 1 0.5 (x v))");
        assert_eq!(tree(" f() "), "(f )");
    }

    #[test]
    fn every_part_knows_its_place() {
        let text = "1 - abs(α + b)";
        let Node::Call { arguments, .. } = parse(text).unwrap().node else { panic!() };
        assert_eq!(&text[arguments[1].span.clone()], "abs(α + b)");
        let Node::Call { at, arguments, .. } = &arguments[1].node else { panic!() };
        assert_eq!((&text[at.clone()], &text[arguments[0].span.clone()]), ("abs", "α + b"));
    }

    #[test]
    fn no_text_is_too_much() {
        for text in
            ["(".repeat(1000), "-".repeat(1000), "1+".repeat(900) + "1", "x^".repeat(999), "[".repeat(3000)]
        {
            let _ = parse(&text);
        }
        assert_eq!(tree(&"(".repeat(100)), "nested more than 64 levels deep");
    }
}
